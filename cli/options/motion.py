"""Options of the virtual encoder: how the shaft moves, and what is wrong with the encoder."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tachometry.cli.options.option import all_of, option, refuse_without
from tachometry.spec import TachometerSpec
from tachometry.spec.language.units import DEGREES, FRACTION, Units, read_nearest

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder

_MOTION, _FAULTS = "Motion", "Encoder faults"

FORMS = """\b
Motions, joined by + into one:
  constant:SPEED:TIME
  ramp:FROM:TO:TIME
  sine:AMPLITUDE:FREQUENCY:TIME
  trapezoid:SPEED:ACCEL_TIME:HOLD_TIME
  stop:TIME
  csv:FILE    alone: a table with the header time,angle_rad in s and rad
Units: rad/s (default), rev/s, rpm; s (default), ms, us, ns;
  Hz (default), kHz, MHz, GHz."""


class Quantity(click.types.FloatParamType):
    """A number, plain or with one of some units."""

    def __init__(self, units: Units, default: str = "") -> None:
        self._units, self._default = units, default

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            return float(value)
        except ValueError:
            return read_nearest(param.name if param and param.name else "number", value, self._units, self._default)


_DEGREES, _FRACTION = Quantity(DEGREES, "deg"), Quantity(FRACTION)


def _motion(required: bool) -> Callable[[Any], Any]:
    return option(
        _MOTION,
        "--motion",
        required=required,
        metavar="MOTION",
        help="How the shaft moves, such as ramp:0:40rad/s:5s; all forms are listed below. With --axes of simulate "
        "several, with commas between: each axis has its own, the last one those that are left, and the next seed.",
    )


_OPTIONS = [
    option(
        _MOTION,
        "--vibration",
        metavar="AMPL:FREQ",
        help="Sinusoidal vibration of the shaft, such as 1mrad:50Hz (rad, mrad or deg; Hz, kHz, MHz or GHz). It is "
        "part of the true motion.",
    ),
    option(
        _FAULTS,
        "--jitter",
        type=_FRACTION,
        default=0,
        metavar="FRACTION",
        help="Gaussian jitter of each edge in time: its standard deviation over the gap to the nearer neighbour, such "
        "as 0.05 or 5%, below 0.5.",
    ),
    option(
        _FAULTS,
        "--nonuniformity",
        type=_FRACTION,
        default=0,
        metavar="FRACTION",
        help="Edges of the disc are displaced by up to this many edge pitches, below 0.5, the same in every turn.",
    ),
    option(
        _FAULTS,
        "--phase-error",
        "phase_error_deg",
        type=_DEGREES,
        default=0,
        metavar="DEGREES",
        help="B's pulse comes this many electrical degrees later than 90 after A's, such as 5 or 5deg; between -90 and "
        "90.",
    ),
    option(
        _FAULTS,
        "--duty-error",
        "duty_error_deg",
        type=_DEGREES,
        default=0,
        metavar="DEGREES",
        help="Pulses of A and B are this many electrical degrees wider than 180, such as 5 or 5deg; between -90 and "
        "90.",
    ),
    option(
        _FAULTS,
        "--bounce",
        metavar="COUNT:TIME",
        help="Contact bounce, such as 3:500us (s, ms, us or ns): after an edge the line falls back COUNT times within "
        "TIME, or within half the way to the next edge.",
    ),
    option(
        _FAULTS,
        "--lost",
        type=_FRACTION,
        default=0,
        metavar="PROBABILITY",
        help="Probability that a line misses a pulse: it stays low, and two edges are lost.",
    ),
    option(
        _FAULTS,
        "--illegal",
        type=_FRACTION,
        default=0,
        metavar="PROBABILITY",
        help="Probability that an edge comes together with the next one: both lines change at once.",
    ),
    option(
        _FAULTS,
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="Seed of all random numbers; equal seeds give equal files.",
    ),
]


def motion_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command: the options of the virtual encoder, handed to the command as two arguments.

    `record` gives what the encoder of a spec, or that of an axis, records of the motion; `tables` are the files that it
    reads.
    """
    return all_of([_motion(required=True), *_OPTIONS], _recording(command))


def disc_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command: the motion, and what may be wrong with the disc and its edges where a loop is closed about
    them.

    They are handed over as `motion`, `jitter`, `nonuniformity`, `phase_error_deg`, `duty_error_deg` and `seed`.
    """
    whole = click.Command(None)
    all_of(_OPTIONS, whole)
    named = dict(zip((parameter.opts[0] for parameter in whole.params[::-1]), _OPTIONS, strict=True))
    kept = ("--jitter", "--nonuniformity", "--phase-error", "--duty-error", "--seed")
    return all_of([_motion(required=True), *(named[name] for name in kept)], command)


def optional_motion_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command as `motion_options`, but without a motion `record` is None."""
    return all_of([_motion(required=False), *_OPTIONS], _recording(command))


def encoder_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a command as `motion_options`, but handed over as `motion`, a text, and `encoder`, a function of a
    spec.
    """
    return all_of([_motion(required=True), *_OPTIONS], _encoding(command))


def tables_of(motion: str) -> list[Path]:
    """Return files that a motion reads, or the motions of several axes."""
    parts = [part.strip().partition(":") for part in {motion, *motion.split(",")}]
    return [Path(table) for kind, _, table in parts if kind == "csv"]


def _recording(command: Callable[..., Any]) -> Callable[..., Any]:

    @functools.wraps(command)
    def build(*, motion: str | None, encoder: Callable[[TachometerSpec], VirtualEncoder], **others: Any) -> Any:
        def record(spec: TachometerSpec, axis: int | None = None, axes: int = 1) -> Encoding:
            from tachometry.sim.encoder.motion import parse_motion

            assert motion is not None
            own = encoder(spec)
            if axis is None:
                return own.record(parse_motion(motion))
            each = motion.split(",")
            if len(each) > axes:
                raise ValueError(
                    f"--motion must have at most one motion for each of the --axes {axes}, not {len(each)}"
                )
            return replace(own, seed=own.seed + axis).record(parse_motion(each[min(axis, len(each) - 1)]))

        if motion is None:
            refuse_without("--motion", _OPTIONS)
            return command(record=None, tables=[], **others)
        return command(record=record, tables=tables_of(motion), **others)

    return _encoding(build)


def _encoding(command: Callable[..., Any]) -> Callable[..., Any]:

    @functools.wraps(command)
    def build(
        *,
        vibration: str | None,
        jitter: float,
        nonuniformity: float,
        phase_error_deg: float,
        duty_error_deg: float,
        bounce: str | None,
        lost: float,
        illegal: float,
        seed: int,
        **others: Any,
    ) -> Any:
        def encoder(spec: TachometerSpec) -> VirtualEncoder:
            from tachometry.sim.encoder.imperfections import Bounce
            from tachometry.sim.encoder.motion import Vibration
            from tachometry.sim.encoder.virtual import VirtualEncoder

            return VirtualEncoder(
                spec.encoder.pulses_per_rev,
                vibration=None if vibration is None else Vibration.parse(vibration),
                jitter=jitter,
                nonuniformity=nonuniformity,
                illegal=illegal,
                seed=seed,
                phase_error_deg=phase_error_deg,
                duty_error_deg=duty_error_deg,
                bounce=None if bounce is None else Bounce.parse(bounce),
                lost=lost,
                index=spec.index,
            )

        return command(encoder=encoder, **others)

    return build
