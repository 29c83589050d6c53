"""Options of the virtual encoder: how the shaft moves, and what is wrong with the encoder."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

from tachometry.cli.options.option import Group, declared, option, refuse_without, take_values
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.signals.files import file_of
from tachometry.spec import TachometerSpec
from tachometry.spec.control import AnySpec
from tachometry.spec.language.option import ParameterError, options_of
from tachometry.spec.language.units import SPEED, parse_time

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
    from tachometry.sim.signals.flow import Flow
    from tachometry.sim.signals.recording import Recording

_MOTION = "Motion"
Core = TypeVar("Core", bound=AnySpec)

FORMS = """\b
Motions, joined by + into one:
  constant:SPEED:TIME
  ramp:FROM:TO:TIME
  sine:AMPLITUDE:FREQUENCY:TIME
  trapezoid:SPEED:ACCEL_TIME:HOLD_TIME
  s-curve:FROM:TO:TIME, or the greatest jerk in place of TIME, as 500rad/s3
  stop:TIME
  torque:FROM:TORQUE:INERTIA:FRICTION:TIME  of a load, in Nm, kg m2, Nm s
  N*(SEGMENT+...)  repeats what is in it
  csv:FILE, csv:FILE:COLUMN  alone: a text with times and a column of speeds
              or angles, whose unit is in its name, as speed_rpm
  counts:FILE:TIME:COUNT  alone, in no loop or sweep: the log of a counter,
              by the names of its columns; see replay --count
Units: rad/s, rev/s, rpm (0 has none); s, ms, us, ns;
  Hz (default), kHz, MHz, GHz."""


def _motion(required: bool) -> Callable[[Any], Any]:
    return option(
        _MOTION,
        "--motion MOTION",
        required=required,
        help="Motion of the shaft, such as ramp:0:40rad/s:5s. All forms are listed below. With --axes several, "
        "with commas between: each axis has its own and its own seed; the last one is for all further "
        "axes.",
    )


_OPTIONS = [declared(about.group, about) for about in options_of(EncoderOptions)]
# What may be wrong where a loop is closed about the encoder.
_OF_LOOPS = ("jitter", "nonuniformity", "eccentricity", "phase-error", "duty-error", "seed")


def read_delay(group: str) -> Callable[[Any], Any]:
    """Return the option that moves the instants at which velocities are read."""
    return option(group, "--read-delay TIME", default="0s", help="Read each velocity TIME after it is valid.")


def delay(name: str, text: str) -> float:
    """Return a time in seconds; ValueError if it is less than 0."""
    if (seconds := float(parse_time(name, text))) < 0:
        raise ParameterError(name, f"must be at least 0, not {text}")
    return seconds


def tables_of(motion: str) -> list[Path]:
    """Return files that a motion reads, or the motions of several axes."""
    parts = [part.strip().partition(":") for part in {motion, *motion.split(",")}]
    return [
        Path(table.rsplit(":", 2)[0] if kind == "counts" else file_of(table)[0])
        for kind, _, table in parts
        if kind in ("csv", "counts")
    ]


def _record(encoder: VirtualEncoder, motion: str, spec: TachometerSpec) -> tuple[Flow | Recording, Encoding]:
    """Return what `VirtualEncoder.flow` does of a motion, which may be a log of what its counter showed."""
    from tachometry.sim.captures.count_log import read_count_log
    from tachometry.sim.captures.file import OptionError
    from tachometry.sim.captures.header import TextOptions
    from tachometry.sim.encoder.motion import Motion, parse_motion

    kind, _, rest = motion.strip().partition(":")
    if kind != "counts":
        return encoder.flow(parse_motion(motion))
    if len(parts := rest.rsplit(":", 2)) != 3 or not all(parts) or ("+" in rest and not Path(parts[0]).exists()):
        raise ParameterError("motion", f"must be counts:FILE:TIME:COUNT alone, not {motion!r}")
    text = TextOptions(parts[1], slowest_s=float(spec.tick.seconds(spec.times.longest)))
    try:
        log = read_count_log(Path(parts[0]), parts[2], text)
    except OptionError as error:
        if error.parameter != "time_unit":
            raise
        name = f"column {parts[1]} of {parts[0]}"
        raise ParameterError(
            "motion", f"has times without a unit: {name} must have it in its name, as time_ms"
        ) from None
    # In the middle of a quarter period, for rounding not to make or lose an edge.
    angle = (log.edges(spec.encoder, encoder.edges_per_rev) + 0.5) * encoder.disc.pitch_rad
    encoding = encoder.record(Motion.of_table(log.time, angle))
    return replace(encoding.recording, source=log.source), encoding


def shown_in_unit_of(motion: str, spec: Core) -> Core:
    """Return a core whose speeds are shown in the unit that the motion was typed in."""
    unit = re.search("|".join(SPEED), motion)
    return spec if unit is None else cast(Core, spec.shown_in(unit[0]))


@dataclass(frozen=True)
class Recorder:
    """Gives what the encoder of a core, or that of an axis, records of the motion."""

    motion: str
    values: Mapping[str, Any]  # of the virtual encoder

    def __call__(self, spec: TachometerSpec, axis: int = 0, axes: int | None = None) -> Encoding:
        """Return the recording, with the truth; ValueError if there are more motions than axes."""
        from tachometry.sim.signals.flow import Flow

        recording, truth = self.flow(spec, axis, axes)
        return replace(truth, recording=recording.whole() if isinstance(recording, Flow) else recording)

    def flow(self, spec: TachometerSpec, axis: int = 0, axes: int | None = None) -> tuple[Flow | Recording, Encoding]:
        """Return the recording, in parts where `VirtualEncoder.flow` gives them, and the truth about it."""
        from tachometry.sim.encoder.sampled import encoder_of

        own = encoder_of(spec, **self.values)
        if axes is None:
            return _record(own, self.motion, spec)
        each = self.motion.split(",")
        if len(each) > axes:
            raise ValueError(f"--motion must have at most one motion for each of the --axes {axes}, not {len(each)}")
        return _record(replace(own, seed=own.seed + axis), each[min(axis, len(each) - 1)], spec)


def _read_record(*, motion: str | None, **given: Any) -> dict[str, Any]:
    values = take_values(EncoderOptions, given)
    if motion is None:
        refuse_without("--motion", _OPTIONS)
        return dict(record=None, tables=[], **given)
    return dict(record=Recorder(motion, values), tables=tables_of(motion), **given)


MOTION_OPTIONS = Group([_motion(required=True), *_OPTIONS], _read_record)
"""The options of the virtual encoder, handed over as two arguments.

`record` is a `Recorder`; `tables` are the files that it reads.
"""

OPTIONAL_MOTION_OPTIONS = Group([_motion(required=False), *_OPTIONS], _read_record)
"""As `MOTION_OPTIONS`, but without a motion `record` is None."""

DISC_OPTIONS = [
    _motion(required=True),
    *(declared(about.group, about) for about in options_of(EncoderOptions) if about.name in _OF_LOOPS),
]
"""The motion, and what may be wrong with the disc and its edges where a loop is closed about them."""
