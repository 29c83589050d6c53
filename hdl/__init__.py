"""Amaranth components are synthesised, one file a box."""

import warnings

from amaranth import hdl

from tachometry.hdl.core.core import AnyTachometer, core_of
from tachometry.hdl.core.peripheral import Peripheral, peripheral
from tachometry.hdl.core.tachometer import Tachometer

__all__ = ["AnyTachometer", "Peripheral", "Tachometer", "core_of", "peripheral"]

# A core that Amaranth warns of is another one than was described: a constant is cut, for example. So these warnings
# are errors in every command. Deprecations are not: another version of Python may add them. A box that is never used is
# reported when it is collected, where no error can be raised; it is one that was made for a core that was refused.
warnings.filterwarnings("error", category=hdl.SyntaxWarning)
warnings.filterwarnings("error", category=UserWarning, module=r".*\b(amaranth|tachometry)\b")
warnings.filterwarnings("ignore", category=hdl.UnusedElaboratable)
