"""What is to be built: frozen objects that hardware, golden models, manifest and documents all read."""

from tachometry.spec.encoder import Encoder
from tachometry.spec.methods.m import MTachometer
from tachometry.spec.methods.mt import MTTachometer
from tachometry.spec.methods.rairan import RairanTachometer
from tachometry.spec.methods.s import STachometer
from tachometry.spec.methods.t import TTachometer
from tachometry.spec.port import Port
from tachometry.spec.tachometer import TachometerSpec
from tachometry.spec.timing import Timing
from tachometry.spec.units import Speed

# Every method by its name. The spec names the module that holds `Datapath` in hdl/ and `Model` in sim/golden/.
METHODS: dict[str, type[TachometerSpec]] = {
    spec.method: spec for spec in (STachometer, MTachometer, TTachometer, MTTachometer, RairanTachometer)
}

__all__ = [
    "METHODS",
    "Encoder",
    "MTTachometer",
    "MTachometer",
    "Port",
    "RairanTachometer",
    "STachometer",
    "Speed",
    "TTachometer",
    "TachometerSpec",
    "Timing",
]
