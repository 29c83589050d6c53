"""From counts to velocity: a datapath for each method, and the boxes that it is made of."""

from collections.abc import Callable

from tachometry.hdl.methods.datapath import Datapath
from tachometry.hdl.methods.m import MMethod
from tachometry.hdl.methods.mt import MTMethod
from tachometry.hdl.methods.rairan import RairanMethod
from tachometry.hdl.methods.s import SMethod
from tachometry.hdl.methods.t import TMethod
from tachometry.hdl.methods.track import TrackMethod

# By the name of the method.
DATAPATHS: dict[str, Callable[..., Datapath]] = {
    "s": SMethod,
    "m": MMethod,
    "t": TMethod,
    "mt": MTMethod,
    "rairan": RairanMethod,
    "track": TrackMethod,
}
