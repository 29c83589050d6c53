"""Every method by its name, and the options of each."""

from functools import cache

from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.timing import Timing
from tachometry.spec.language.option import Option, ParameterError, options_of
from tachometry.spec.methods.m import MTachometer
from tachometry.spec.methods.mt import MTTachometer
from tachometry.spec.methods.rairan import RairanTachometer
from tachometry.spec.methods.s import STachometer
from tachometry.spec.methods.t import TTachometer
from tachometry.spec.methods.track import TrackTachometer

# Every method by its name; `DATAPATHS` in hdl/ and `MODELS` in sim/golden/ hold what belongs to it.
METHODS: dict[str, type[TachometerSpec]] = {
    spec.method: spec
    for spec in (STachometer, MTachometer, TTachometer, MTTachometer, RairanTachometer, TrackTachometer)
}

AUTO = "auto"


@cache
def common_options() -> tuple[Option, ...]:
    """Return options that every method has."""
    return (*options_of(Encoder), *options_of(Timing), *options_of(TachometerSpec))


@cache
def own_options(method: str) -> tuple[Option, ...]:
    """Return options of a method beyond those that every method has, and those of these that it has in another way."""
    common = common_options()
    return tuple(about for about in options_of(METHODS[method]) if about not in common)


def methods_with(name: str) -> list[str]:
    """Return methods that have an option of their own by this name."""
    return [method for method in METHODS if any(about.name == name for about in own_options(method))]


def method_named(text: str) -> str:
    """Return the name of a method as it is in the table, of `MT`, `M/T`, `s` or `tracking`; else the text."""
    plain = text.strip().lower().replace("/", "")
    titles = {spec.facts.title.lower().replace("/", ""): name for name, spec in METHODS.items()}
    name = titles.get(plain, plain)
    return name if name in METHODS or name == AUTO else text


def spec_class(method: str) -> type[TachometerSpec]:
    """Return the spec of a method; ParameterError if there is none of this name."""
    if method not in METHODS:
        raise ParameterError("method", f"must be one of {', '.join((AUTO, *METHODS))}, not {method!r}")
    return METHODS[method]
