"""The functions of a script or notebook make a core by its options, plan, simulate, replay, compare and write it."""

from __future__ import annotations

import inspect
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Unpack

import numpy as np
from numpy.typing import NDArray

from tachometry.cli.files import Outputs
from tachometry.cli.options.motion import shown_in_unit_of
from tachometry.cli.options.option_aliases import meant
from tachometry.hdl.export import export
from tachometry.sim.captures.count_log import read_angle_log, read_count_log
from tachometry.sim.captures.header import TextOptions
from tachometry.sim.captures.read import read_capture, with_last_tick
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.shown import Shown
from tachometry.sim.studies.comparing.comparison import Comparison, Judging, Source, comparison
from tachometry.sim.studies.plan import Plan, default_range, plan_at
from tachometry.sim.studies.simulation import Axis, Running, Simulation
from tachometry.sim.studies.simulation import simulate as simulation_of
from tachometry.spec import METHODS, CoreSpec, TachometerSpec, common_options, of_options, own_options
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.language.option import ParameterError, options_of, read_options
from tachometry.spec.language.units import format_time

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tachometry.options import CoreOptions, EncoderFaults

__all__ = ["Run", "Tachometer", "compare", "generate", "plan", "read_capture", "replay", "simulate"]

_OPTIONS = {
    about.name.replace("-", "_"): about
    for about in (*common_options(), *(one for method in METHODS for one in own_options(method)), *options_of(LoopSpec))
}
_TIMES = [name for name, about in _OPTIONS.items() if about.metavar == "TIME"] + ["index_skew"]
_WORDS = [f"--{about.name}" for about in _OPTIONS.values()]


def Tachometer(**options: Unpack[CoreOptions]) -> AnySpec:  # a noun, as it makes what it says
    """Return a core, as `tachometry generate` makes it of options of these names, with _ for each - within a name.

    Values are texts as on the command line, numbers, and True or False for flags: `ppr=500, max_speed="400rad/s"`.
    There are also `method` (without it the best that fits the tick), `axes`, `parallel` and `loop`. It raises
    ParameterError if there is no such option, or its value is wrong.

    Examples
    --------
    >>> spec = Tachometer(ppr=2500, clock="100MHz", tick="100us", max_speed="6000rpm", method="mt")
    >>> spec.method, spec.timing.tick_cycles
    ('mt', 10000)
    """
    for name in options:
        if name not in Tachometer.__signature__.parameters:  # type: ignore[attr-defined]
            near = [f": did you mean {one.lstrip('-').replace('-', '_')}" for one in meant(name, _WORDS)]
            raise ParameterError(name, f"must not be given, there is no such option{''.join(near[:1])}")
    with _in_python():
        return of_options(_texts(options))


Tachometer.__signature__ = inspect.Signature(  # type: ignore[attr-defined]  # editors complete the names
    [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=str | None)
        for name in ("method", *_OPTIONS, "axes", "parallel", "loop")
    ],
    return_annotation=AnySpec,
)


def _texts(options: Mapping[str, object]) -> dict[str, str]:
    """Return options as the command line has them."""
    return {name.replace("_", "-"): _text(name, value) for name, value in options.items() if value is not None}


def _text(name: str, value: object) -> str:
    if isinstance(value, float) and name in _TIMES:
        raise ParameterError(name, f'must have its unit, as in "{format_time(Fraction(str(value)))}", not {value}')
    if isinstance(value, bool):
        return ("no", "yes")[value]
    return str(int(value) if isinstance(value, float) and value.is_integer() else value)


@contextmanager
def _in_python() -> Iterator[None]:
    """Call options by their names in Python where a message has those of the command line."""
    try:
        yield
    except ValueError as error:
        said = [re.sub(r"--([a-z][\w-]*)", lambda one: one[1].replace("-", "_"), str(text)) for text in error.args]
        if isinstance(error, ParameterError):
            error.parameter, error.rest = error.parameter.replace("-", "_"), said[1]
        error.args = tuple(said)
        raise


@dataclass(frozen=True, repr=False)
class Run(Shown):
    """Holds what a core has shown, compared with its golden model in every bit.

    `simulation.lockstep` has the rows of every port, `simulation.axes` what each axis made of them.
    """

    simulation: Simulation
    axis: int = 0  # whose arrays are shown

    @property
    def _axis(self) -> Axis:
        return self.simulation.axes[self.axis]

    @property
    def n_mismatches(self) -> int:
        """Number of values in which hardware and golden model differ: 0."""
        return self.simulation.lockstep.n_mismatches

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the ticks from the first update on, in seconds, shape (n,)."""
        return self._axis.held.time

    @property
    def velocity(self) -> NDArray[np.float64]:
        """Velocity that the core shows at these times, in rad/s, shape (n,)."""
        return self._axis.held.velocity_rad_s

    @property
    def true_velocity(self) -> NDArray[np.float64] | None:
        """True velocity of the shaft at these times, in rad/s, shape (n,); None: a capture does not have it."""
        truth = self._axis.truth
        return None if truth is None else truth.true_speed(self.time)

    @property
    def position(self) -> NDArray[np.int64]:
        """Position at each tick in counts, shape (m,)."""
        return self._axis.run.ticks.position

    def plot(self, path: str | os.PathLike[str] | None = None) -> Figure | None:
        """Draw velocity, error, pulse numbers and measurement times into a .png or .pdf; else return the figure."""
        from tachometry.sim.plots.run import draw, save_plot  # Matplotlib is slow to import
        from tachometry.sim.plots.style import styled

        truth = self._axis.truth
        what = self._axis.spec, self._axis.run, None if truth is None else truth.true_speed
        if path is None:
            with styled():
                return draw(*what)
        save_plot(Path(path), *what)
        return None

    def _repr_png_(self) -> bytes:
        from tachometry.sim.plots.style import picture

        return picture(lambda: self.plot(), ".png")  # type: ignore[arg-type,return-value]

    def shown(self) -> tuple[str, list[list[str]]]:
        """Return how long it is, how fast the shaft was, and how far the velocity is from it."""
        axis, unit = self._axis, self._axis.spec.scale.shown_unit
        rows = [["updates", str(len(axis.run.updates))], ["mismatches", str(self.n_mismatches)]]
        rows.append(["counts", str(axis.counts_out)])
        if len(self.velocity):
            ends = " to ".join(f"{unit.of(value):.6g}" for value in (self.velocity.min(), self.velocity.max()))
            rows.append(["velocity", f"{ends} {unit.name}"])
        if axis.error is not None:
            rows.append(["error, RMS", f"{unit.of(axis.error.rms):.4g} {unit.name}"])
        return f"run of method {axis.spec.method}, {len(axis.run.ticks)} ticks", rows


def plan(spec: AnySpec, speeds: Sequence[float] | None = None) -> Plan:
    """Return what a core measures at constant speeds of an ideal encoder, as `tachometry plan` prints it.

    Speeds are in rad/s; None: eight over the range of the core, which are printed in its own unit.

    Examples
    --------
    >>> spec = Tachometer(ppr=500, clock="1MHz", tick="1ms", method="s")
    >>> float(plan(spec, [10.0]).resolution[0]) < 0.2
    True
    """
    core = spec.tachometer
    if speeds is None:
        return replace(plan_at(core, np.geomspace(*default_range(core), 8)), unit=core.scale.shown_unit.name)
    return plan_at(core, speeds)


def simulate(
    spec: AnySpec, motion: str | Sequence[str], *, engine: str = "auto", **encoder: Unpack[EncoderFaults]
) -> Run:
    """Run a core on a virtual encoder, against its golden model, as `tachometry simulate` does.

    Of a core with a loop, the tachometer alone is run. A motion is that of `--motion`, `"ramp:0:40rad/s:500ms"`; many
    axes have one each. Faults of the encoder are the command's options: `jitter=0.05, nonuniformity=0.1, seed=2`. It
    raises ValueError if a motion, an engine or an option is wrong.

    Examples
    --------
    >>> spec = Tachometer(ppr=500, clock="1MHz", tick="1ms", method="s")
    >>> run = simulate(spec, "constant:300rpm:50ms", jitter=0.05)
    >>> run.n_mismatches, round(float(run.velocity[-1]), 1)
    (0, 31.4)
    """
    motions = [motion] if isinstance(motion, str) else motion
    if len(motions) != (spec.axes or 1):
        raise ValueError(f"motion must be one for each of {spec.axes or 1} axes, not {len(motions)}")
    truths = [_recorded(spec, one, axis, encoder) for axis, one in enumerate(motions)]
    recordings = [truth.recording for truth in truths]
    return _run(shown_in_unit_of(" ".join(motions), spec), "motion", recordings, truths, engine)


def replay(
    spec: AnySpec,
    *captures: str | os.PathLike[str] | Recording,
    engine: str = "auto",
    count: str | None = None,
    angle: str | None = None,
) -> Run:
    """Run a core on captured signals, one capture for each axis, as `tachometry replay` does.

    Channels of files are found by their names; `read_capture` takes other names, and gives a Recording. `count` or
    `angle` is the column of a log, as of the command. It raises ValueError if a capture is wrong.
    """
    text = TextOptions(slowest_s=float(spec.tachometer.tick.seconds(spec.tachometer.times.longest)))

    def read(path: str | os.PathLike[str]) -> Recording:
        if (column := count or angle) is None:
            return read_capture(path, text=text)
        log = (read_count_log if count else read_angle_log)(Path(path), column, text)
        return log.recording(spec.tachometer.encoder)

    with _in_python():
        recordings = [one if isinstance(one, Recording) else read(one) for one in captures]
    if len(recordings) != (spec.axes or 1):
        raise ValueError(f"captures must be one for each of {spec.axes or 1} axes, not {len(recordings)}")
    return _run(spec, "the capture", [with_last_tick(one, _core(spec)) for one in recordings], None, engine)


def compare(specs: Sequence[TachometerSpec], motion: str, **encoder: Unpack[EncoderFaults]) -> Comparison:
    """Compare cores on the same edges of a virtual encoder, as `tachometry compare` does.

    The first one's encoder, clock and tick are those of all; `motion` and `encoder` are as of `simulate`. It raises
    ValueError if a method is there twice; if a motion or an option is wrong.

    Examples
    --------
    >>> cores = [Tachometer(ppr=500, clock="1MHz", tick="1ms", method=method) for method in ("s", "mt")]
    >>> [score.name for score in compare(cores, "constant:300rpm:50ms", jitter=0.05).scores]
    ['s', 'mt']
    """
    named = {spec.method: spec for spec in specs}
    if len(named) != len(specs) or not specs:
        raise ValueError("specs must be of different methods, at least one")
    truth = _recorded(specs[0], motion, 0, encoder)
    source = Source("motion", truth.recording, truth.true_speed, truth.true_angle)
    spec = shown_in_unit_of(motion, specs[0])
    return comparison(spec, dict(named), lambda method, texts: named[method], source, Judging())


def generate(
    spec: AnySpec,
    folder: str | os.PathLike[str],
    name: str = "tachometer",
    *,
    bus: str | None = None,
    baud: int | None = None,
    target: str = "none",
    irq: bool = False,
) -> list[Path]:
    """Write a core as Verilog, with its manifest and all that it takes to build it in, as `tachometry generate` does.

    The folder is made if it does not exist, and files in it are overwritten; `name` is that of the module and of the
    files. For the others see `tachometry.hdl.export.export`. It returns the paths, and raises ValueError for a name, a
    bus or a target that cannot be, OSError if the files cannot be written.
    """
    texts = export(spec, name, bus, baud, target, irq)
    places = {file: Path(folder) / file for file in texts}
    with Outputs(places) as outputs:  # all of them, or none
        for file, text in texts.items():
            outputs[file].write_text(text, encoding="utf-8", newline="\n")
    return [*places.values()]


def _recorded(spec: AnySpec, motion: str, axis: int, encoder: Mapping[str, object]) -> Encoding:
    known = [about.name.replace("-", "_") for about in options_of(EncoderOptions)]
    for name in encoder:
        if name not in known:
            raise ParameterError(name, f"must be an option of the encoder: {', '.join(known)}")
    with _in_python():
        values = read_options(EncoderOptions, _texts(encoder))
        whole = encoder_of(spec.tachometer, **values)
        return replace(whole, seed=whole.seed + axis).record(parse_motion(motion))


def _run(spec: AnySpec, source: str, recordings: list[Recording], truths: list[Encoding] | None, engine: str) -> Run:
    return Run(simulation_of(_core(spec), source, recordings, truths, Running(engine)))


def _core(spec: AnySpec) -> CoreSpec:
    core: CoreSpec = spec.tachometer if spec.axes is None else spec
    return core
