"""The page asks these functions: each takes texts of options, and returns what JSON can hold.

Nothing here knows of a server, so that the page can also be served without one. A wrong option is refused as on the
command line, by `Refused` with the same line.
"""

import base64
import inspect
import io
import math
import re
import shlex
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import click
import numpy as np
from numpy.typing import NDArray

from tachometry.cli.commands import Refused, refusals
from tachometry.cli.commands.generate import ASKED, Asked
from tachometry.cli.options.capture import CAPTURE_OPTIONS
from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.help import needed
from tachometry.cli.options.methods import Methods, named_methods
from tachometry.cli.options.motion import OPTIONAL_MOTION_OPTIONS
from tachometry.cli.options.option import RESEARCH, GroupedCommand, Option, options_named
from tachometry.cli.options.sweep_settings import arguments, yes
from tachometry.cli.reports.compare import shown_scores, shown_time
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.temporary import scratch
from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES, OF_READS
from tachometry.sim.studies.comparing.comparison import Judging, Source, comparison
from tachometry.sim.studies.estimate import FAMILIES
from tachometry.sim.studies.plan import Plan, Plans, cells_of, default_range
from tachometry.sim.studies.size import CORE, SEEDS, measure_core, versions
from tachometry.sim.theory.performance import REAL_DISC
from tachometry.spec import METHODS, TachometerSpec, Timing, methods_with, of_texts
from tachometry.spec.language.option import ParameterError, options_of
from tachometry.spec.language.units import short_time
from tachometry.spec.registers.buses import ports_on

Texts = Mapping[str, str]  # of options, by their names without dashes; empty: without the option
Answer = dict[str, Any]
Made = TypeVar("Made")

_LONGEST = 4000  # characters of a text
_POINTS, _POINTS_OF_TIME = 300, 1500  # of a curve
_MOST = 1_000_000  # counts, and ticks, of a motion
# Groups that are no part of a core, by the part of the page that has them.
_PARTS = {"Motion": "motion", "Encoder faults": "motion", "Capture": "capture"}
_DEFAULT = re.compile(r"\s+\[(?:default: ([^\]]+?))?(?:(?:; )?\d*<?=?x[<>=]+\d+|required)?\]$")
_START = {"ppr": "500", "clock": "100MHz", "tick": "100us", "max-speed": "6000rpm"}
_FACTS = (
    *("method", "range", "worst error", "real disc", "delay", "standstill", "one LSB of velocity", "advice", "note"),
)
_WRITTEN = (1980, 1, 1, 0, 0, 0)  # when all files of archives were: equal ones have equal bytes


@click.command("generate", cls=GroupedCommand)
@ASKED
def _generate(asked: Asked) -> Asked:
    return asked


@click.command("compare", cls=GroupedCommand)
@OPTIONAL_MOTION_OPTIONS
def _moved(record: Callable[..., Encoding] | None, tables: list[Path]) -> Callable[..., Encoding] | None:
    return None if tables else record


@click.command("replay", cls=GroupedCommand)
@CAPTURE_OPTIONS
def _captured(read: Callable[..., Recording]) -> Callable[..., Recording]:
    return read


def answer(name: str, args: Mapping[str, Any], functions: Mapping[str, Callable[..., Answer]]) -> Answer:
    """Return what one of these functions answers; where it refuses, the line as `error` and the `field` it is of."""
    try:
        function = functions.get(name)
        if function is None:
            raise ValueError(f"it must be one of {', '.join(functions)}, not {name!r}")
        wanted = inspect.signature(function).parameters
        for one, given in args.items():
            alone = one in wanted and wanted[one].annotation is str
            texts = given.values() if isinstance(given, dict) and not alone else [given if alone else None]
            if not all(isinstance(text, str) for text in texts):
                raise ValueError(f"{one} must be of texts")
        inspect.signature(function).bind(**args)
    except (TypeError, ValueError) as error:
        return {"error": f"invalid request: {error}", "field": ""}
    try:
        return function(**args)
    except Refused as error:
        line = str(error).partition(" (see tachometry ")[0]
        named = re.search(r"--([a-z][a-z-]*)", line)
        return {"error": line, "field": named[1] if named else ""}


def options() -> Answer:
    """Return what can be asked for: options by groups, and those that most need."""
    of_core, groups = _options_of(_generate), dict[str, list[Answer]]()
    for one in (of_core | _options_of(_captured)).values():
        of_method = one.group.startswith("Method ")
        groups.setdefault("Method" if of_method else one.group, []).append(_described(one))
    groups[RESEARCH] = groups.pop(RESEARCH)  # the last
    return {
        "groups": [{"title": title, "part": _PARTS.get(title, "core"), "options": of} for title, of in groups.items()],
        "needed": [_name(one) for one in needed([*of_core.values()])],
        "start": _START
        | {one.name: str(REAL_DISC[one.field]) for one in options_of(EncoderOptions) if one.field in REAL_DISC},
        "methods": {name: spec.facts.summary for name, spec in METHODS.items()},
    }


def check(options: Texts) -> Answer:
    """Return what a core is: the command that writes it, its ports, and rows of names and values."""

    def of(asked: Asked) -> Answer:
        return {
            "module": asked.manifest["module"],  # which also says what cannot be
            "method": asked.spec.tachometer.method,
            "command": f"tachometry generate {_typed(options)} -o build",
            "rows": asked.rows,
            "facts": _FACTS,
            "ports": [asdict(port) for port in ports_on(asked.spec, asked.on)],
            "motions": _motions(asked.spec.tachometer),
        }

    return _run(_generate, options, of)


def files(options: Texts) -> Answer:
    """Return an archive with the files that `generate` writes; its bytes in base64."""
    name, texts = _run(_generate, options, lambda asked: (asked.name, asked.texts()))
    packed = io.BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        for file, text in texts.items():
            archive.writestr(ZipInfo(file, _WRITTEN), text.encode(), ZIP_DEFLATED)
    return {"name": f"{name}.zip", "files": [*texts], "zip": base64.b64encode(packed.getvalue()).decode()}


def _greatest(values: NDArray[np.float64], starts: Sequence[int]) -> list[float | None]:
    """Return the greatest of the values from each start to the next, None where there is no number."""
    found = _numbers(values)
    near = (found[first:last] for first, last in pairwise([*starts, len(found)]))
    return [max((value for value in each if value is not None), default=None) for each in near]


def curves(options: Texts) -> Answer:
    """Return error, delay and standstill of all methods over speed, that of the options first; its theory is `plan`'s.

    The error is the greatest near each speed at constant speed, with a real disc. None: a method cannot measure there.
    """
    core = _core(options)
    methods = _methods(options, core)
    specs = {name: spec for name, spec in methods.specs.items() if spec is not None} | {core.method: core}
    plans = Plans(core, specs, *default_range(core))
    unit, near = core.scale.shown_unit, np.geomspace(plans.low, plans.high, _POINTS + 1)[:-1]
    every = plans.line.speed.tolist()
    starts = sorted({bisect_left(every, speed) for speed in near.tolist()})

    def shown(name: str, spec: TachometerSpec, plan: Plan) -> Answer:
        error = plan.resolution + plan.disc + spec.velocity.rounding_lsb * spec.velocity.rad_per_s_per_lsb
        late = float(spec.tick.seconds(spec.latency.tick_to_velocity) + spec.times.filter_lag)
        delay = late + plan.measurement_time / 2 * (not spec.words.on_ramps)
        at = zip(_numbers(unit.of(error)), every, strict=True)
        known = [value for value, speed in at if value is not None and speed >= plans.range[0]]  # as in `generate`
        delays = _greatest(delay, starts)
        longest = max((value for value in delays if value is not None), default=0)
        worst = (f"{max(known):.4g}", shown_time(longest)) if known else ("-", "-")
        rest = spec.times.standstill_ticks * spec.timing.tick_seconds
        own = name == core.method
        cells = "see the core" if own else str(cells_of(spec) or "-")  # a reference core has other options
        row = [*worst, short_time(rest), cells]
        return dict(name=name, own=own, error=_greatest(unit.of(error), starts), delay=delays, cells=row)

    each = [shown(name, plans.methods[name], plan) for name, plan in plans.lines.items()]
    return {
        "unit": unit.name,
        "x": [float(f"{unit.of(every[start]):.6g}") for start in starts],
        "heads": ["method", f"worst error ({unit.name})", "longest delay", "standstill within", "plain cells (ECP5)"],
        "curves": sorted(each, key=lambda one: not one["own"]),
        "left_out": methods.left_out,
    }


def respond(options: Texts, motion: Texts) -> Answer:
    """Return what the golden model of the core, other methods and other projects show of a motion."""

    def of(record: Callable[..., Encoding] | None) -> Answer:
        if record is None:
            raise ParameterError(
                "motion", "must be given here, and must not be a file: drop a capture, or take compare"
            )
        moved = parse_motion(motion["motion"])
        edges = moved.max_travel * core.encoder.counts_per_rev / math.tau
        ticks = moved.duration / float(core.timing.tick_seconds)
        if max(edges, ticks) > _MOST:
            rest = f"must be of at most {_MOST} counts and ticks, not {max(edges, ticks):.3g}: take tachometry compare"
            raise ParameterError("motion", rest)
        truth = record(core)
        return _response(options, core, Source("--motion", truth.recording, truth.true_speed, truth.true_angle))

    core = _core(options)
    return _run(_moved, motion, of)


def replay(options: Texts, capture: Texts, name: str, data: str) -> Answer:
    """Return what they show of a capture: the bytes of a file of this name, in base64."""
    core = _core(options)
    return _of_capture(
        core, capture, name, data, lambda one: _response(options, core, Source("the capture", one, None))
    )


def calibrate(options: Texts, capture: Texts, name: str, data: str) -> Answer:
    """Return the report, the picture and the map of a disc, from a capture of a shaft that coasts down."""
    from tachometry.cli.explore.disc import described  # Matplotlib is slow to import

    return _of_capture(core := _core(options), capture, name, data, lambda one: described(one, core))


def _of_capture(
    core: TachometerSpec, capture: Texts, name: str, data: str, of: Callable[[Recording], Answer]
) -> Answer:
    suffixes = re.search(r"(\.[a-z0-9]{1,10}){0,2}$", name.lower())
    with scratch() as folder:
        file = folder / f"capture{suffixes[0] if suffixes else ''}"
        try:
            file.write_bytes(base64.b64decode(data, validate=True))
            return _run(_captured, capture, lambda read: of(read(file, core)))
        except ValueError as error:
            raise Refused(f"the capture must come as base64: {error}") from error
        except Refused as error:
            raise Refused(str(error).replace(str(file), name)) from error


def estimate(options: Texts) -> Answer:
    """Return the estimated cells and greatest clock of a core, as `generate` prints them."""
    return _run(_generate, options, lambda asked: {"size": "; ".join(f"{name} {text}" for name, text in asked.size)})


def size(options: Texts) -> Answer:
    """Return cells and Fmax of a core on its family, as `compare --size` measures them in half a minute."""

    def of(asked: Asked) -> Answer:
        try:
            target = FAMILIES[asked.family].target
            verilog = replace(asked, name=CORE).texts()[f"{CORE}.v"]
            ports = ports_on(asked.spec, asked.on)
            found = measure_core(asked.spec, target, verilog, versions(target.route[0]), ports, SEEDS[:3])
        except RuntimeError as error:
            raise click.ClickException(f"the size cannot be measured: {error}") from error
        figures = {name: f"{value:.0f}" for name, value in found.figures.items() if value and name != "latency"}
        figures["Fmax"] += " MHz"
        return {"size": ", ".join(f"{name} {text}" for name, text in figures.items()), "limit": found.limit}

    return _run(_generate, options, of)


def _response(options: Texts, core: TachometerSpec, source: Source) -> Answer:
    methods = _methods(options, core)
    known = BASELINES if core.encoder.sampled is None else OF_READS
    rivals = {name: one.title for name, one in known.items() if not one.missing}
    specs = {core.method: core} | methods.specs | {core.method: core} | dict.fromkeys(rivals)
    found = comparison(core, specs, of_texts, source, Judging())
    unit = core.scale.shown_unit
    heads, rows = shown_scores(found, unit)
    at = found.instants[0][:: -(-len(found.instants[0]) // _POINTS_OF_TIME)]
    each = zip(found.curves, rows, strict=True)
    return {
        "unit": unit.name,
        "x": _numbers(at),
        "true": None if source.true_speed is None else _numbers(unit.of(source.true_speed(at))),
        "heads": heads,
        "curves": [
            {
                "name": curve.name,
                "own": curve.name == core.method,
                "rival": curve.name in rivals,
                "what": rivals.get(curve.name, ""),
                "velocity": _numbers(unit.of(curve.estimate.at(at))),
                "cells": row[1:],
            }
            for curve, row in each
        ],
    }


def _core(options: Texts) -> TachometerSpec:
    return _run(_generate, options, lambda asked: asked.spec.tachometer)


def _methods(options: Texts, core: TachometerSpec) -> Methods:
    """Return the same core of one axis alone with every method, at the tick that was taken."""
    ticks = [about.name for about in options_of(Timing) if about.field == "tick_cycles"]
    alone = of_one_axis(options).items()
    texts = {name: text for name, text in alone if text and name not in ticks and not methods_with(name)}
    texts["tick"] = core.options["tick"]
    with refusals():
        return named_methods("all", lambda method, own: of_texts(method, {**texts, **own}))


def of_one_axis(options: Texts) -> dict[str, str]:
    """Return the options that describe a core of one axis, without a loop and without its method."""
    return {name: text for name, text in options.items() if name in core_click_options()}


def _motions(spec: TachometerSpec) -> dict[str, str]:
    """Return motions that suit a core, by what they are."""
    top, tick = default_range(spec)[1], float(spec.timing.tick_seconds)
    time, fast, slow = max(0.1, 100 * tick), f"{0.9 * top:.3g}rad/s", f"{top / 200:.3g}rad/s"
    t, half = f"{time:.3g}s", f"{time / 2:.3g}s"
    return {
        "start, run and stop": f"s-curve:0:{fast}:{t}+constant:{fast}:{t}+s-curve:{fast}:0:{t}+stop:{t}",
        "reversal": f"constant:{fast}:{half}+ramp:{fast}:-{fast}:{t}+constant:-{fast}:{half}",
        "ramp": f"ramp:0:{fast}:{t}",
        "sine": f"sine:{fast}:{2 / time:.3g}Hz:{2 * time:.3g}s",
        "crawl": f"constant:{slow}:{2 * time:.3g}s",
        "steps": f"constant:{slow}:{half}+constant:{fast}:{half}+constant:{slow}:{half}+stop:{half}",
    }


def _numbers(values: NDArray[np.float64]) -> list[float | None]:
    """Return numbers as JSON has them, to six digits."""
    return [None if math.isnan(value) else float(f"{value:.6g}") for value in values.tolist()]


def _run(command: click.Command, texts: Texts, of: Callable[[Any], Made]) -> Made:
    """Run a command with these options, and return what `of` makes of its result; `Refused` as on the command line."""
    with refusals(), _defaults(command) as context, options_named():
        known = _options_of(command)
        for name, text in texts.items():
            if name not in known:
                raise ValueError(f"there is no option --{name} of {command.name}")
            if len(text) > _LONGEST:
                raise ValueError(f"--{name} must have at most {_LONGEST} characters, not {len(text)}")
            if text:
                value = yes(name, text) if known[name].is_flag else text
                known[name].handle_parse_result(context, {str(known[name].name): value}, [])
        return of(command.invoke(context))


def _defaults(command: click.Command) -> click.Context:
    """Return a context in which each option of a command has its default."""
    context = command.make_context(f"tachometry {command.name}", [], resilient_parsing=True)
    context.resilient_parsing = False
    return context


def _options_of(command: click.Command) -> dict[str, Option]:
    return {_name(one): one for one in command.get_params(click.Context(command)) if isinstance(one, Option)}


def _name(one: click.Option) -> str:
    return one.opts[0].removeprefix("--")


def _described(one: Option) -> Answer:
    _, help = one.get_help_record(click.Context(_generate)) or ("", "")
    metavar, choices = one.metavar or "", []
    if isinstance(one.type, click.Choice):
        choices = [*one.type.choices]
    elif metavar.startswith("[") and metavar == metavar.lower():
        choices = metavar.strip("[]").split("|")
    default = _DEFAULT.search(help)
    return {
        "name": _name(one),
        "help": _DEFAULT.sub("", help),
        "default": (default[1] or "") if default else "none" * ("none" in choices),
        "choices": choices,
        "flag": one.is_flag,
        "metavar": "" if choices else re.sub(r"^\[([^\[\]]*)\]$", r"\1", metavar).replace("|", " or "),
        "methods": methods_with(_name(one)),
    }


def _typed(texts: Texts) -> str:
    """Return options as they are typed."""
    words = arguments({name: text or None for name, text in texts.items()}, _options_of(_generate))
    pairs = [(name, text) for name, _, text in (word.partition("=") for word in words)]
    return " ".join(
        name if not text else f"{name}{'=' if text.startswith('-') else ' '}{shlex.quote(text)}" for name, text in pairs
    )


_ANSWERS = (options, check, curves, files, respond, replay, calibrate, estimate, size)
FUNCTIONS: dict[str, Callable[..., Answer]] = {one.__name__: one for one in _ANSWERS}
