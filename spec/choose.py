"""The core that texts of options describe: of a named method, or of the best one that suits the tick."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.core.described import CHOSEN
from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.extras import EXTRAS
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.timing import Timing
from tachometry.spec.language.files import MOST_JSON, read_text
from tachometry.spec.language.option import ParameterError, options_of, parse_flag, parse_whole, read_options
from tachometry.spec.methods.axes import AxesSpec, CoreSpec
from tachometry.spec.methods.s import STachometer
from tachometry.spec.methods.table import (
    AUTO,
    METHODS,
    common_options,
    method_named,
    methods_with,
    own_options,
    spec_class,
)
from tachometry.spec.methods.track import TrackTachometer, in_loop

_PREFERRED = ("track", "mt", "s")  # the first of them that can be is what `auto` takes
# Where none is given, the tick is the first of these with which the method can be.
_TICKS = "20us 25us 40us 50us 100us 125us 160us 200us 250us 320us 500us 1ms".split()
_MOST_MACHINES = 2  # with which tracking of many axes is taken: each has multipliers of the FPGA, and takes 800 cells
_OF_TICK = ("tick", "tick_cycles", "max_time", "max_ticks")  # parameters that another tick may suit

Build = Callable[[TachometerSpec], Any]  # makes of a core of one axis the core that is wanted


def of_texts(method: str, texts: Mapping[str, str | None], build_core: Build = lambda spec: spec) -> TachometerSpec:
    """Return the core that texts of options describe, as on the command line, in files of sweeps and in tests.

    - `method`: One of `METHODS`, or `auto`: track where its program fits the tick, else M/T where its division does,
      else S. An option that only some methods have leaves the others out. `chosen` then has the reason.
    - `texts`: By the names of the options without dashes, `{"ppr": "500", "max-speed": "400rad/s"}`; flags are `yes` or
      `no`. None stands for leaving the option out. Without a tick it is 20 µs, or as long as the method needs at the
      clock.
    - `build_core`: Makes the whole core of the tachometer; if it raises ParameterError, `auto` takes another method.

    It raises ParameterError if the method has no such option, or a text is not what it must be.
    """
    given: Mapping[str, str] = {name: text for name, text in texts.items() if text is not None}
    for extra in EXTRAS:
        given = extra.respelled(given)
    method = method_named(method)
    few_machines = partial(_few_machines, build_core)
    if method != AUTO:
        try:
            return _with_tick(method, given, few_machines)
        except _Crowded:  # it was asked for
            return _with_tick(method, given, build_core)
    (*better, last), asked = _methods_with_options(given)
    refused: list[str] = []
    for name in better:
        try:
            spec = _with_tick(name, given, few_machines)
            if (clocks := spec.wanted_room) > spec.tick.room:
                raise ParameterError("tick_cycles", f"must be at least {clocks}", f"needs a tick of {clocks} clocks")
            return _explained(spec, build_core, refused, asked)
        except ParameterError as error:
            refused.append(f"{name} {error.brief}")
    return _explained(_with_tick(last, given, build_core), build_core, refused, asked)


def _explained(spec: TachometerSpec, build_core: Build, refused: list[str], asked: list[str]) -> TachometerSpec:
    """Return a core with the reason for its method."""
    why = " and ".join(refused)
    if not why and asked:
        why = f"it has --{asked[0]}"
    elif not why:
        core = build_core(spec)
        fits = f"the turns of {core.axes} axes" if isinstance(core, AxesSpec) else f"its {spec.latency.busy} clocks"
        why = f"{fits} fit the tick of {spec.timing.tick_cycles} clocks"
    return replace(spec, chosen=f"as {why}")


def _with_tick(method: str, given: Mapping[str, str], build_core: Build) -> TachometerSpec:
    """Return the core of these options; without a tick among them, with the first of the usual ones that suits it."""
    has_tick = any(about.name in given for about in options_of(Timing) if about.field == "tick_cycles")
    refused: list[ParameterError] = []
    for texts in [given] if has_tick else [{**given, "tick": tick} for tick in _TICKS]:
        try:
            spec = _of_method(method, texts)
            build_core(spec)
            return spec
        except ParameterError as error:
            if error.parameter not in _OF_TICK:
                raise
            refused.append(_reworded_for_core(error, build_core))
    raise next((error for error in refused if isinstance(error, _Crowded)), refused[0])


def _reworded_for_core(error: ParameterError, build_core: Build) -> ParameterError:
    """Return the whole core's error for this tick: many axes may need a longer one."""
    if error.refused is not None:
        try:
            build_core(error.refused)
        except ParameterError as of_core:
            return of_core if of_core.parameter in _OF_TICK else error
    return error


def _methods_with_options(given: Mapping[str, str]) -> tuple[list[str], list[str]]:
    """Return methods that have all of these options, the best first, and the options that not all of the best have.

    It raises ParameterError if there is no such method.
    """

    def has(method: str, name: str) -> bool:
        declared = (*common_options(), *own_options(method))
        return any(about.name == name and about.fits_in(METHODS[method]) for about in declared)

    asked = [name for name in given if not all(has(method, name) for method in _PREFERRED)]
    able = [name for name in METHODS if all(has(name, one) for one in asked)]
    if not able:
        if unknown := {name: given[name] for name in asked if not any(has(method, name) for method in METHODS)}:
            _of_method(_PREFERRED[-1], unknown)
        others = " and ".join(f"--{name}" for name in asked[:-1])
        raise ParameterError(asked[-1], f"must not be given together with {others}: no method has all of them")
    return [name for name in _PREFERRED if name in able] or able, asked


class _Crowded(ParameterError):
    """The turns of many axes take more machines than tracking is taken with."""


def _few_machines(build_core: Build, spec: TachometerSpec) -> None:
    """Refuse tracking of many axes with a ParameterError where the turns of a tick take more than two machines."""
    core = build_core(spec)
    if isinstance(core, AxesSpec) and (machines := core.plan.machines) > _MOST_MACHINES:
        other = f"--tick {core.tick_of(_MOST_MACHINES)}"
        raise _Crowded("tick_cycles", f"must be longer: try {other}", f"needs {machines} machines or {other}")


def _of_method(method: str, texts: Mapping[str, str]) -> TachometerSpec:
    """Return the core of a method."""
    spec = spec_class(method)
    known = {about.name: about for about in (*common_options(), *own_options(method))}
    for name in texts:
        parameter = name.replace("-", "_")
        if name not in known:
            others = " and ".join(methods_with(name))
            why = f"it is for {others}" if others else "there is no such option"
            raise ParameterError(parameter, f"must not be given with method {method}: {why}")
        if not known[name].fits_in(spec):
            other = next(about.name for about in known.values() if about.field == known[name].field)
            able = " and ".join(one for one in METHODS if known[name].fits_in(METHODS[one]))
            instead = f": it is for {able}" if other == name else f", but {other}"
            raise ParameterError(parameter, f"must not be given with method {method}{instead}")
    encoder = Encoder(**read_options(Encoder, texts))
    timing = Timing(**read_options(Timing, texts, usual=spec.facts.usual))
    return spec(encoder=encoder, timing=timing, **read_options(spec, texts, vars(timing)))


def of_options(options: Mapping[str, str]) -> AnySpec:
    """Return the core that `options` describe, of one axis, of many or with a loop: those of a core or of a manifest.

    It raises ParameterError if they are not those of a core.
    """
    texts = dict(options)
    axes, parallel, loop = (texts.pop(name, "no") for name in ("axes", "parallel", "loop"))
    of_loop = {about.name: texts.pop(about.name) for about in options_of(LoopSpec) if about.name in texts}
    method, chosen = texts.pop("method", AUTO), texts.pop(CHOSEN, "")

    def whole(spec: TachometerSpec) -> AnySpec:
        core: CoreSpec = spec
        if axes != "no":
            core = with_axes(spec, parse_whole("axes", axes), parallel=parse_flag("parallel", parallel))
        looped = with_loop if method == AUTO else _looped
        return looped(core, of_loop) if parse_flag("loop", loop) else core

    spec = of_texts(method, texts, whole)
    return whole(replace(spec, chosen=chosen) if chosen else spec)


def with_axes(spec: TachometerSpec, axes: int, *, parallel: bool) -> AxesSpec:
    """Return a core of so many axes, each of which is as `spec`; ParameterError if there cannot be one."""
    if not isinstance(spec, STachometer | TrackTachometer):
        why = f"must be s or track together with --axes, not {spec.method}"
        raise ParameterError("method", why, "is of one axis")
    return AxesSpec(tachometer=spec, axes=axes, parallel=parallel)


def with_loop(spec: CoreSpec, texts: Mapping[str, str]) -> LoopSpec:
    """Return a core with a control loop, from texts of its options; ParameterError if there cannot be one.

    The tachometer is as such a loop needs it: with method track, its memory is bounded.
    """
    loop = _looped(spec, texts)
    return replace(loop, tachometer=in_loop(loop.tachometer, loop.velocity_gain))


def _looped(spec: CoreSpec, texts: Mapping[str, str]) -> LoopSpec:
    if spec.axes is not None:
        raise ParameterError("axes", "must be left out with --loop, which is of one axis")
    return LoopSpec(tachometer=spec.tachometer, **read_options(LoopSpec, texts, vars(spec.timing)))


def of_manifest(path: Path) -> AnySpec:
    """Return the core of a manifest, the file NAME.json that lies beside its Verilog.

    It raises ValueError if the file is no manifest; ParameterError if this version of tachometry makes no such core.
    """
    try:
        options = json.loads(read_text(path, MOST_JSON))["options"]
        texts = {str(name): str(text) for name, text in options.items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"{path} must be a manifest that tachometry writes, with options") from error
    return of_options(texts)
