"""Frozen objects say what is to be built: hardware, golden models, manifest and documents all read them."""

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.timing import Timing
from tachometry.spec.language.files import MOST_JSON, read_text
from tachometry.spec.language.option import Option, ParameterError, options_of, parse_flag, parse_whole, read_options
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
    given = {**spec.usual, **{name: text for name, text in texts.items() if text is not None}}
    known = {about.name: about for about in (*common_options(), *own_options(method))}
    for name in given:
        parameter = name.replace("-", "_")
        if name not in known:
            others = " and ".join(methods_with(name))
            why = f"it is for {others}" if others else "there is no such option"
            raise ParameterError(parameter, f"must not be given with method {method}: {why}")
        if not known[name].fits_in(spec):
            other = next(about.name for about in known.values() if about.field == known[name].field)
            instead = "" if other == name else f", but {other}"
            raise ParameterError(parameter, f"must not be given with method {method}{instead}")
    encoder, timing = Encoder(**read_options(Encoder, given)), Timing(**read_options(Timing, given))
    return spec(encoder=encoder, timing=timing, **read_options(spec, given, vars(timing)))


def of_options(options: Mapping[str, str]) -> AnySpec:
    """Return the core that `options` describe, of one axis, of many or with a loop: those of a core or of a manifest.

    Raises
    ------
    ParameterError
        If they are not those of a core.
    """
    texts = dict(options)
    axes, parallel, loop = (texts.pop(name, "no") for name in ("axes", "parallel", "loop"))
    of_loop = {about.name: texts.pop(about.name) for about in options_of(LoopSpec) if about.name in texts}
    spec: CoreSpec = of_texts(texts.pop("method", ""), texts)
    if axes != "no":
        spec = with_axes(spec.tachometer, parse_whole("axes", axes), parallel=parse_flag("parallel", parallel))
    return _looped(spec, of_loop) if parse_flag("loop", loop) else spec


def with_axes(spec: TachometerSpec, axes: int, *, parallel: bool) -> AxesSpec:
    """Return a core of so many axes, each of which is as `spec`; ParameterError if there cannot be one."""
    if not isinstance(spec, STachometer):
        raise ParameterError("method", f"must be s together with --axes, not {spec.method}")
    return AxesSpec(tachometer=spec, axes=axes, parallel=parallel)


def with_loop(spec: CoreSpec, texts: Mapping[str, str]) -> LoopSpec:
    """Return a core with a control loop, from texts of its options; ParameterError if there cannot be one.

    The tachometer is as such a loop needs it: with method track, its memory is bounded.
    """
    loop = _looped(spec, texts)
    return replace(loop, tachometer=loop.tachometer.in_loop(loop.velocity_gain))


def _looped(spec: CoreSpec, texts: Mapping[str, str]) -> LoopSpec:
    if spec.axes is not None:
        raise ParameterError("axes", "must not be given together with --loop: it is of one axis")
    return LoopSpec(tachometer=spec.tachometer, **read_options(LoopSpec, texts, vars(spec.timing)))


def of_manifest(path: Path) -> AnySpec:
    """Return the core of a manifest, the file NAME.json that lies beside its Verilog.

    Raises
    ------
    ValueError
        If the file is no manifest.
    ParameterError
        If this version of tachometry makes no such core.
    """
    try:
        options = json.loads(read_text(path, MOST_JSON))["options"]
        texts = {str(name): str(text) for name, text in options.items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path} must be a manifest that tachometry writes, with options") from error
    return of_options(texts)


__all__ = [
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
    "methods_with",
    "of_manifest",
    "of_options",
    "of_texts",
    "own_options",
    "spec_class",
    "with_axes",
    "with_loop",
]
