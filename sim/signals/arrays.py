"""Names the kinds of arrays that signals are made of."""

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Levels = NDArray[np.uint8]
