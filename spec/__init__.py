"""Frozen objects say what is to be built: hardware, golden models, manifest and documents all read them."""

from collections.abc import Mapping
from itertools import chain, combinations
from typing import Any

from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.parameters import TWO_TICKS
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.timing import Timing
from tachometry.spec.language.option import Option, ParameterError, is_derived, options_of, read_options
from tachometry.spec.language.port import Port
from tachometry.spec.language.units import Speed
from tachometry.spec.methods.axes import AxesSpec, CoreSpec
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


def common_options() -> tuple[Option, ...]:
    """Return options that every method has."""
    return (*options_of(Encoder), *options_of(Timing), *options_of(TachometerSpec))


def own_options(method: str) -> tuple[Option, ...]:
    """Return options of a method beyond those that every method has, and those of these that it has in another way."""
    common = common_options()
    return tuple(about for about in options_of(METHODS[method]) if about not in common)


def methods_with(name: str) -> list[str]:
    """Return methods that have an option of their own by this name."""
    return [method for method in METHODS if any(about.name == name for about in own_options(method))]


def spec_class(method: str) -> type[TachometerSpec]:
    """Return the spec of a method; ParameterError if there is none of this name."""
    if method not in METHODS:
        raise ParameterError("method", f"must be one of {', '.join(METHODS)}, not {method!r}")
    return METHODS[method]


def of_texts(method: str, texts: Mapping[str, str | None]) -> TachometerSpec:
    """Return the core that texts of options describe, as on the command line, in files of sweeps and in tests.

    Parameters
    ----------
    method : str
        One of `METHODS`.
    texts : mapping of str to str or None
        By the names of the options without dashes, `{"ppr": "500", "max-speed": "400rad/s"}`; flags are `yes` or `no`.
        None stands for leaving the option out.

    Raises
    ------
    ParameterError
        If the method has no such option, or a text is not what it must be.
    """
    spec = spec_class(method)
    given = {name: text for name, text in texts.items() if text is not None}
    known = {about.name: about for about in (*common_options(), *own_options(method))}
    for name in given:
        parameter = name.replace("-", "_")
        if name not in known:
            others = " and ".join(methods_with(name))
            why = f"it is for {others}" if others else "there is no such option"
            raise ParameterError(parameter, f"must not be given with method {method}: {why}")
        if (fits := known[name].fits) is not None and not fits(spec):
            other = next(about.name for about in known.values() if about.field == known[name].field)
            instead = "" if other == name else f", but {other}"
            raise ParameterError(parameter, f"must not be given with method {method}{instead}")
    encoder, timing = Encoder(**read_options(Encoder, given)), Timing(**read_options(Timing, given))
    return spec(encoder=encoder, timing=timing, **read_options(spec, given))


def of_parameters(parameters: Mapping[str, Any]) -> TachometerSpec:
    """Return the core whose `parameters` a manifest has.

    Raises
    ------
    ParameterError
        If they are not those of a core, or not of this version.
    """
    spec = spec_class(parameters.get("method", ""))
    expected = {about.field for part in (Encoder, Timing, spec) for about in options_of(part)}
    for name in sorted(expected ^ (parameters.keys() - {"method"})):
        what = "is missing" if name in expected else "is none of them"
        raise ParameterError("parameters", f"must be those that this version of tachometry writes: {name} {what}")

    def values(part: type[Any]) -> dict[str, Any]:
        return {about.field: about.of_canonical(parameters[about.field]) for about in options_of(part)}

    encoder, timing, own = Encoder(**values(Encoder)), Timing(**values(Timing)), values(spec)
    # What follows from the rest may be what must not be given, such as a width of 5 bits.
    optional = [about.field for about in options_of(spec) if about.default is None or is_derived(about.default)]
    refused: ParameterError | None = None
    for omitted in chain.from_iterable(combinations(optional, number) for number in range(len(optional) + 1)):
        given = {name: value for name, value in own.items() if name not in omitted}
        try:
            found = spec(encoder=encoder, timing=timing, **given)
        except ParameterError as error:
            refused = refused or error
            continue
        if found.parameters == parameters:
            return found
    raise refused or ParameterError("parameters", "must be those of a core that this version of tachometry makes")


__all__ = [
    "METHODS",
    "TWO_TICKS",
    "AxesSpec",
    "CoreSpec",
    "Encoder",
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
    "methods_with",
    "of_parameters",
    "of_texts",
    "own_options",
    "spec_class",
]
