"""What is to be built: frozen objects that hardware, golden models, manifest and documents all read."""

from tachometry.spec.encoder import Encoder
from tachometry.spec.s_method import STachometer
from tachometry.spec.tachometer import Port, TachometerSpec
from tachometry.spec.timing import Timing
from tachometry.spec.units import Speed

__all__ = ["Encoder", "Port", "STachometer", "Speed", "TachometerSpec", "Timing"]
