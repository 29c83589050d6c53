"""What all tests share."""

import os
from pathlib import Path

# Compiled cores stay in the checkout.
os.environ.setdefault("TACHOMETRY_CACHE", str(Path(__file__).parent.parent / "build" / "cache"))
