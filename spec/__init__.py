"""Frozen objects say what is to be built: hardware, golden models, manifest and documents all read them."""

from tachometry.spec.choose import of_manifest, of_options, of_texts, with_axes, with_loop
from tachometry.spec.control import LoopSpec
from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.timing import Timing
from tachometry.spec.language.option import Option, ParameterError
from tachometry.spec.language.port import Port
from tachometry.spec.language.units import Speed
from tachometry.spec.methods.axes import AxesSpec, CoreSpec
from tachometry.spec.methods.m import MTachometer
from tachometry.spec.methods.mt import MTTachometer
from tachometry.spec.methods.rairan import RairanTachometer
from tachometry.spec.methods.s import STachometer
from tachometry.spec.methods.t import TTachometer
from tachometry.spec.methods.table import (
    AUTO,
    METHODS,
    common_options,
    method_named,
    methods_with,
    own_options,
    spec_class,
)
from tachometry.spec.methods.track import TrackTachometer

__all__ = [
    "AUTO",
    "METHODS",
    "AxesSpec",
    "CoreSpec",
    "Encoder",
    "LoopSpec",
    "MTTachometer",
    "MTachometer",
    "Option",
    "ParameterError",
    "Port",
    "RairanTachometer",
    "STachometer",
    "Speed",
    "TTachometer",
    "TachometerSpec",
    "Timing",
    "TrackTachometer",
    "common_options",
    "method_named",
    "methods_with",
    "of_manifest",
    "of_options",
    "of_texts",
    "own_options",
    "spec_class",
    "with_axes",
    "with_loop",
]
