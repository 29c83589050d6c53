"""A point of a sweep: a core on a motion, what it is known by, and the row of figures that comes of it."""

import functools
import hashlib
import pickle
import platform
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from importlib.util import find_spec
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from tachometry.sim import golden
from tachometry.sim.build import digest
from tachometry.sim.encoder.motion import Motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pick import pick
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.comparing.compare import Judge, begun, run_curve, score
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import METHODS, Option, TachometerSpec, own_options
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import format_time

Row = dict[str, Any]

# Columns of what came of a point.
_RESULTS: dict[str, tuple[str, str]] = {
    "point": ("text", "digest of all that decides the row"),
    "method": ("text", "as in `methods`"),
    "motion": ("text", "as in `motion`, its values in place"),
    "engine": ("text", "what ran the hardware beside the golden model"),
    "mismatches": ("int", "values in which hardware and golden model differ"),
    "clocks": ("int", "clocks of the core"),
    "updates": ("int", "updates of the velocity"),
    "forced_updates": ("int", "those by the maximum time alone"),
    "updates_per_s": ("float", "1/s"),
    "mean_time_s": ("float", "s, mean measurement time"),
    "worst_time_s": ("float", "s, longest measurement time"),
    "true_rms_rad_s": ("float", "rad/s, RMS of the true speed while it is compared"),
    "rms_error_rad_s": ("float", "rad/s, RMS error of the velocity when it is read"),
    "max_error_rad_s": ("float", "rad/s, greatest error"),
    "relative_error": ("float", "RMS error over RMS of the true speed"),
    "delay_s": ("float", "s, shift of the true speed that comes closest"),
}
# Those of what it is: kind, content, and the value of a core,
_CORE: dict[str, tuple[str, str, Callable[[TachometerSpec], Any]]] = {
    "ppr": ("int", "pulses per revolution", lambda spec: spec.encoder.pulses_per_rev),
    "decoding": ("int", "counts per pulse", lambda spec: spec.encoder.decoding),
    "clock_hz": ("int", "Hz", lambda spec: spec.timing.clock_hz),
    "tick_s": ("float", "s; with Rairán's method dt", lambda spec: _seconds(spec, spec.timing.tick_cycles)),
    "max_time_s": ("float", "s", lambda spec: _seconds(spec, spec.timing.max_ticks * spec.timing.tick_cycles)),
    "max_tick_period_s": ("float", "s, of an external tick", lambda spec: _of(spec, "max_tick_cycles", "clocks")),
    "unit": ("text", "of the velocity", lambda spec: spec.unit),
    "frac_bits": ("int", "bits", lambda spec: spec.velocity.frac_bits),
    "velocity_width": ("int", "bits", lambda spec: spec.velocity.width),
    "max_speed_rad_s": ("float", "rad/s", lambda spec: spec.max_speed and spec.max_speed.rad_per_s),
    "position_width": ("int", "bits", lambda spec: spec.position_width),
    "filter": ("int", "clocks", lambda spec: spec.filter_clocks),
    "index": ("bool", "as the option", lambda spec: spec.index is not None),
    "index_reset": ("bool", "as the option", lambda spec: spec.front_end.index_resets),
    "age": ("bool", "as the option", lambda spec: spec.age),
    "bounds": ("bool", "as the option", lambda spec: spec.bounds),
    "edge_error": (
        "float",
        "counts, of the bounds",
        lambda spec: float(spec.bound.edge_error) if spec.bounds else None,
    ),
    "lowpass_rad_s": ("float", "rad/s", lambda spec: None if spec.lowpass is None else float(spec.lowpass)),
}
# and of an encoder.
_ENCODER: dict[str, tuple[str, str, Callable[[VirtualEncoder], Any]]] = {
    "vibration_rad": ("float", "rad, amplitude", lambda encoder: encoder.vibration and encoder.vibration.amplitude_rad),
    "vibration_hz": ("float", "Hz", lambda encoder: encoder.vibration and encoder.vibration.frequency_hz),
    "jitter": ("float", "fraction of a gap", attrgetter("jitter")),
    "nonuniformity": ("float", "edge pitches", attrgetter("nonuniformity")),
    "eccentricity": ("float", "edge pitches", attrgetter("eccentricity")),
    "phase_error_deg": ("float", "electrical degrees", attrgetter("phase_error_deg")),
    "duty_error_deg": ("float", "electrical degrees", attrgetter("duty_error_deg")),
    "bounce_count": ("int", "per edge", lambda encoder: encoder.bounce and encoder.bounce.count),
    "bounce_s": ("float", "s", lambda encoder: encoder.bounce and encoder.bounce.time_s),
    "lost": ("float", "probability", attrgetter("lost")),
    "illegal": ("float", "probability", attrgetter("illegal")),
    "seed": ("int", "as the option", attrgetter("seed")),
}
_FROM = {
    "from_s": ("float", "s, errors before are left out"),
    "read_delay_s": ("float", "s, from the valid velocity to its reading"),
}
_KINDS = {bool: "bool", int: "int", str: "text"}


class _Columns(Mapping[str, tuple[str, str]]):
    """All columns; among them those of the options that methods have of their own, as they are declared."""

    def __getitem__(self, name: str) -> tuple[str, str]:
        return self._all()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._all())

    def __len__(self) -> int:
        return len(self._all())

    def _all(self) -> dict[str, tuple[str, str]]:
        own = {_column(about): _content(about) for method in METHODS for about in own_options(method)}
        core, encoder = ({name: each[:2] for name, each in known.items()} for known in (_CORE, _ENCODER))
        return _RESULTS | core | own | encoder | _FROM


# Every column of the results: its kind, and what is in it, with its unit. What does not exist or cannot be determined
# is empty.
COLUMNS = _Columns()


def _column(about: Option) -> str:
    """Name of the column of a method's option, with its unit; clocks are shown as seconds."""
    return about.field + {"clocks": "_s", "rad/s": "_rad_s"}.get(about.unit, "")


def _content(about: Option) -> tuple[str, str]:
    if about.unit == "clocks":
        return "float", "s"
    kind = "int" if about.limits else _KINDS.get(type(about.default), "float")
    return kind, about.unit or "as the option"


@dataclass(frozen=True)
class Point:
    """Describes a core on a motion; ValueError if it is shorter than a tick, or no two ticks of it are compared."""

    method: str  # what the method is called
    spec: TachometerSpec
    encoder: VirtualEncoder
    motion: Motion
    text: str  # the motion in words
    # what the sweep varies within the motion, in rad/s, s and Hz: a column each
    values: dict[str, float] = field(default_factory=dict)
    earliest: float = 0.0  # seconds: errors before it are left out
    engine: str | None = None  # what runs the hardware; None: the golden model alone, which it equals
    read_delay: float = 0.0  # seconds: a loop reads each value this much later

    def __post_init__(self) -> None:
        needed = self.spec.tick.longest + self.spec.latency.tick
        if self.motion.duration * self.spec.timing.clock_hz < needed:
            least = format_time(self.spec.tick.seconds(needed))
            raise ParameterError(
                "motion", f"must last at least {needed} clocks of --clock ({least}), a tick and its latency"
            )
        duration = self.motion.duration
        if self.earliest and duration - self.earliest < 2 * float(self.spec.timing.tick_seconds):
            lasts = format_time(Fraction(f"{duration:.6g}"))
            raise ParameterError("motion", f"must last two ticks or more beyond --from, longer than {lasts}")

    @functools.cached_property
    def digest(self) -> str:
        """Digest of all that decides the row, the code that makes it included."""
        motion = [array.tobytes() for array in vars(self.motion).values()]
        rest = (self.method, self.spec, self.encoder, self.values, self.earliest, self.engine, self.read_delay)
        return digest(self.code, motion, *rest)

    @property
    def code(self) -> str:
        """Digest of the code that the row depends on."""
        return code_digest(hardware=self.engine is not None)


class OtherCode(ImportError):
    """A worker has another version."""


# Code that decides the row of a point, and, where an engine runs the hardware beside the golden model, that, too.
_CODE = (
    "spec",
    "sim/build.py",
    "sim/golden",
    "sim/captures",
    "sim/encoder",
    "sim/signals",
    *(f"sim/studies/{name}.py" for name in ("__init__", "lockstep", "sweeping/__init__", "sweeping/sweep")),
    *(f"sim/studies/comparing/{name}.py" for name in ("__init__", "compare", "baselines")),
)
_HARDWARE_CODE = ("hdl", "sim/engines")


@functools.cache
def code_digest(hardware: bool = False) -> str:
    """Digest of the code that rows depend on, those with an engine if `hardware`: equal code gives equal results."""
    found = hashlib.sha256()
    for name in (*_CODE, *(_HARDWARE_CODE if hardware else ())):
        layer, _, rest = name.partition("/")
        for file in _sources(_layer(layer) / rest):
            found.update(f"{layer}/{file.relative_to(_layer(layer)).as_posix()}\n".encode())
            found.update(file.read_bytes())
    return found.hexdigest()


def _layer(name: str) -> Path:
    module = find_spec(f"tachometry.{name}")  # not imported: the golden models need no Amaranth
    assert module is not None
    assert module.origin is not None
    return Path(module.origin).parent


def _sources(place: Path) -> list[Path]:
    if place.is_file():
        return [place]
    return sorted(path for path in place.rglob("*") if path.suffix in (".py", ".h"))


def run_packed(code: str, packed: bytes) -> Iterator[Row | Exception]:
    """Yield `run_point` of pickled points, on any machine with the same code, or the error of a point.

    It raises OtherCode if the code here is another.
    """
    if code not in (code_digest(), code_digest(hardware=True)):
        raise OtherCode(f"{platform.node()} has another one")
    for point in pickle.loads(packed):
        try:
            yield run_point(point)
        except ValueError as error:
            yield ParameterError.longer(error, f" (method {point.method}, motion {point.text})")
        except OSError as error:
            yield error


def run_point(point: Point) -> Row:
    """Run a point: its row, with all of `COLUMNS` and one for each of its values.

    It raises ValueError if the motion has too many edges, and OSError if the engine lacks what it needs here.
    """
    spec, encoding = point.spec, point.encoder.record(point.motion)
    duration = encoding.recording.duration
    trace = PinTrace.of(encoding.recording, spec)
    run = golden.run(spec, trace)
    engine = point.engine and pick(point.engine)
    mismatches = lockstep(spec, trace, engine, expected=run).n_mismatches if engine else None
    curve = run_curve(point.method, spec, run, trace)
    instants = np.empty(0)
    if len(run.updates.clock):
        judge = Judge(encoding.true_speed, begun([curve], point.earliest), duration, point.read_delay)
        instants = judge.among(curve.reads)
    found = score(curve, duration, instants, encoding.true_speed)
    truth = encoding.true_speed(instants)
    true_rms = float(np.sqrt(np.mean(truth * truth))) if len(truth) else None
    figures = {
        "point": point.digest,
        "method": point.method,
        "motion": point.text,
        "engine": point.engine,
        "mismatches": mismatches,
        "clocks": trace.n_clocks,
        "updates": len(run.updates.clock),
        "forced_updates": int(np.count_nonzero(run.updates.forced)),
        "updates_per_s": found.updates_per_second,
        "mean_time_s": found.mean_time,
        "worst_time_s": found.worst_time,
        "true_rms_rad_s": true_rms,
        "rms_error_rad_s": found.rms,
        "max_error_rad_s": found.max,
        "relative_error": found.rms / true_rms if found.rms is not None and true_rms else None,
        "delay_s": found.delay,
        "from_s": point.earliest,
        "read_delay_s": point.read_delay,
    }
    return dict.fromkeys(COLUMNS) | figures | _configured(spec, point.encoder) | point.values


def _configured(spec: TachometerSpec, encoder: VirtualEncoder) -> Row:
    """Return columns of the configuration, and of the encoder and what is wrong with it."""
    own = {_column(about): _of(spec, about.field, about.unit) for about in own_options(spec.method)}
    of_encoder = {name: value(encoder) for name, (_, _, value) in _ENCODER.items()}
    return {name: value(spec) for name, (_, _, value) in _CORE.items()} | own | of_encoder


def _of(spec: TachometerSpec, field: str, unit: str) -> Any:
    """Return what an option of a core is, in the unit of its column."""
    value = spec.parameters.get(field, getattr(spec, field))  # tacit ones are missing at their defaults
    return float(getattr(spec, field)) if unit == "rad/s" else _seconds(spec, value) if unit == "clocks" else value


def _seconds(spec: TachometerSpec, clocks: int | None) -> float | None:
    return None if clocks is None else float(spec.tick.seconds(clocks))
