"""Options of the virtual encoder: how the shaft moves, and what is wrong with the encoder."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tachometry.cli.options.option import Group, declared, option, refuse_without, take_values
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.spec import TachometerSpec
from tachometry.spec.language.option import options_of

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder

_MOTION = "Motion"

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


def _motion(required: bool) -> Callable[[Any], Any]:
    return option(
        _MOTION,
        "--motion",
        required=required,
        metavar="MOTION",
        help="How the shaft moves, such as ramp:0:40rad/s:5s; all forms are listed below. With --axes of simulate "
        "several, with commas between: each axis has its own, the last one those that are left, and the next seed.",
    )


_OPTIONS = [declared(about.group, about) for about in options_of(EncoderOptions)]
# What may be wrong where a loop is closed about the encoder.
_OF_LOOPS = ("jitter", "nonuniformity", "phase-error", "duty-error", "seed")


def tables_of(motion: str) -> list[Path]:
    """Return files that a motion reads, or the motions of several axes."""
    parts = [part.strip().partition(":") for part in {motion, *motion.split(",")}]
    return [Path(table) for kind, _, table in parts if kind == "csv"]


def _read_encoder(**given: Any) -> dict[str, Any]:
    values = take_values(EncoderOptions, given)

    def encoder(spec: TachometerSpec) -> VirtualEncoder:
        from tachometry.sim.encoder.virtual import VirtualEncoder

        return VirtualEncoder(spec.encoder.pulses_per_rev, index=spec.index, **values)

    return dict(encoder=encoder, **given)


def _read_record(*, motion: str | None, **given: Any) -> dict[str, Any]:
    others = _read_encoder(**given)
    encoder = others.pop("encoder")

    def record(spec: TachometerSpec, axis: int = 0, axes: int | None = None) -> Encoding:
        from tachometry.sim.encoder.motion import parse_motion

        assert motion is not None
        own: VirtualEncoder = encoder(spec)
        if axes is None:
            return own.record(parse_motion(motion))
        each = motion.split(",")
        if len(each) > axes:
            raise ValueError(f"--motion must have at most one motion for each of the --axes {axes}, not {len(each)}")
        return replace(own, seed=own.seed + axis).record(parse_motion(each[min(axis, len(each) - 1)]))

    if motion is None:
        refuse_without("--motion", _OPTIONS)
        return dict(record=None, tables=[], **others)
    return dict(record=record, tables=tables_of(motion), **others)


MOTION_OPTIONS = Group([_motion(required=True), *_OPTIONS], _read_record)
"""The options of the virtual encoder, handed over as two arguments.

`record` gives what the encoder of a spec, or that of an axis, records of the motion; `tables` are the files that it
reads.
"""

OPTIONAL_MOTION_OPTIONS = Group([_motion(required=False), *_OPTIONS], _read_record)
"""As `MOTION_OPTIONS`, but without a motion `record` is None."""

ENCODER_OPTIONS = Group(MOTION_OPTIONS.options, _read_encoder)
"""As `MOTION_OPTIONS`, but handed over as `motion`, a text, and `encoder`, a function of a spec."""

DISC_OPTIONS = [
    _motion(required=True),
    *(declared(about.group, about) for about in options_of(EncoderOptions) if about.name in _OF_LOOPS),
]
"""The motion, and what may be wrong with the disc and its edges where a loop is closed about them."""
