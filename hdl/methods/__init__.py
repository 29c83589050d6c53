"""From counts to velocity: a datapath for each method, and the boxes that it is made of."""

from typing import Any

from tachometry.hdl.methods.m import MMethod
from tachometry.hdl.methods.mt import MTMethod
from tachometry.hdl.methods.rairan import RairanMethod
from tachometry.hdl.methods.s import SMethod
from tachometry.hdl.methods.t import TMethod

# By the name of the method.
DATAPATHS: dict[str, Any] = {
    "s": SMethod,
    "m": MMethod,
    "t": TMethod,
    "mt": MTMethod,
    "rairan": RairanMethod,
}
