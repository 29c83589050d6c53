"""Options of captures: which channels are the encoder's lines."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tachometry.cli.options.option import Group, option, plain_options, refuse_without
from tachometry.spec import CoreSpec
from tachometry.spec.core.sensors import READ
from tachometry.spec.language.units import parse_frequency

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.signals.flow import Flow
    from tachometry.sim.signals.recording import Recording

_CAPTURE = "Capture"

_WRAP = """Counts after which --count wraps to 0; 0: it does not. [default: 65536 or 4294967296 where it jumps by more \
than half of that, else 0]"""
_SAMPLERATE = "Samplerate of a capture without times, such as 24MHz. For a .sr file or a text."


_OPTIONS = [
    *plain_options(
        _CAPTURE,
        {
            "--a CHANNEL": "Channel of line A: its name, or its number from 0. With --axes one for each "
            "axis, with commas between, also for --b and --z; without them a0, a1 and so on, "
            "b0, z0. Of an absolute encoder its clock (MA, SCK) or, of T-format, the request (TX).",
            "--b CHANNEL": "Channel of line B. Of an absolute encoder its data (SLO, MISO, RX). [default of "
            "--a and --b: the channels named A and B, else the first two]",
            "--c CHANNEL": "Channel of line C of halls. [default: c with --sensor hall]",
            "--z CHANNEL": "Channel of line Z, the index. [default: z with --index, else none]",
            "--tick-in CHANNEL": "Channel of the external tick. [default: tick_in with --external-tick, else none]",
            "--time COLUMN": "Column of the times in a text: a name, or a number from 0. [default: the column "
            "named time]",
            "--time-unit UNIT": "Unit of the times in a text, or their clock as 16MHz. s, ms, us or ns. [default: "
            "as the name of the column ends, such as time_ms or Time [us], else s]",
            "--threshold V[:V]": "Voltage above which a line is high, as 1.65V:200mV. For columns of an "
            "oscilloscope; the second voltage is the hysteresis. [default: levels are 0 or 1]",
            "--count COLUMN": "Column of counts in a text of times and counts. A name, or a number from 0. "
            "Between two rows the shaft turns evenly; a count is one of --ppr and --decoding. "
            "With --axes as --a.",
            "--angle COLUMN[:UNIT]": "Column of the shaft's angle in a text. Its unit is rad, deg or turn, in its "
            "name, in the line of units or typed. Between two rows the shaft turns evenly. With --axes as --a.",
            "--pulse-times COLUMN": "Read each row of a text as a pulse at this time. Needs --sensor pulses. [default: "
            "a text that has times alone]",
            "--pulse-periods COLUMN": "Read each row of a text as a pulse after this period. Needs --sensor pulses.",
        },
    ),
    option(_CAPTURE, "--wrap N", type=click.IntRange(0, 1 << 53), help=_WRAP),
    option(_CAPTURE, "--samplerate FREQUENCY", help=_SAMPLERATE),
]


_LINES = ("a", "b", "c", "z", "tick_in", "threshold", "samplerate", "pulse_times", "pulse_periods")


def _read(
    *, time: str | None, time_unit: str | None, count: str | None, angle: str | None, wrap: int | None, **others: Any
) -> dict[str, Any]:
    lines: dict[str, str | None] = {name: others.pop(name) for name in _LINES}
    a, b, c, z, tick_in, threshold, samplerate, pulse_times, pulse_periods = lines.values()

    def read(capture: Path, spec: CoreSpec, axis: int = 0, *, parts: bool = False) -> Recording | Flow:
        from tachometry.sim.captures.cell_parsers import parse_threshold
        from tachometry.sim.captures.count_log import read_angle_log, read_count_log
        from tachometry.sim.captures.file import SAME, CaptureError, Channels, OptionError, is_stream
        from tachometry.sim.captures.header import TextOptions
        from tachometry.sim.captures.other_sensors import fitted
        from tachometry.sim.captures.read import read_parts, with_last_tick
        from tachometry.sim.captures.time_unit import parse_time_unit
        from tachometry.sim.studies.captured_reads import of_frames

        alone, axes = spec.tachometer, spec.axes
        sensor = alone.encoder.sensor
        text = TextOptions(
            time,
            None if time_unit is None else parse_time_unit("time_unit", time_unit),
            None if threshold is None else parse_threshold("threshold", threshold),
            slowest_s=float(alone.tick.seconds(alone.times.longest)),
            pulse_times=pulse_times,
            pulse_periods=pulse_periods,
        )
        if axes and is_stream(capture):
            raise CaptureError(f"{capture} must be a regular file with --axes: it is read anew for each axis")
        for name, column in (("count", count), ("angle", angle)):
            if column is None:
                continue
            more = {"sensor": None if alone.encoder.plain else sensor, "index": alone.index}
            _refuse_lines(name, {**lines, **more, "differential": alone.front_end.complemented or None})
            read_log = read_count_log if name == "count" else read_angle_log
            log = read_log(capture, _of_axis(name, column, axis, axes) or "", text, wrap)
            return with_last_tick(log.recording(alone.encoder), spec)
        if wrap is not None:
            raise OptionError("wrap", "must not be given without --count or --angle")
        for line, text_of_line in (("b", b), ("c", c)):
            if text_of_line is not None and line not in (alone.encoder.kind.lines or "b"):
                raise OptionError(line, f"must not be given together with --sensor {sensor}")
        line_a, line_b = (_of_axis(line, text, axis, axes) for line, text in (("a", a), ("b", b)))
        index = _of_axis("z", z, axis, axes) if z is not None or "z" in alone.front_end.lines else None
        tick = "tick_in" if tick_in is None and alone.external_tick else tick_in
        rate = None if samplerate is None else float(parse_frequency("samplerate", samplerate))
        second = SAME if sensor == "pulses" else line_b
        third = (c or "c") if sensor == "hall" else None
        named = {"c": third, "z": index, "tick_in": tick} | {f"{n}_n": f"{n}_n" for n in alone.front_end.complemented}
        others = {name: channel for name, channel in named.items() if channel is not None}
        flow = read_parts(capture, Channels(line_a, line_b if sensor in READ else second, others), rate, text)
        if sensor in READ:
            return of_frames(flow.whole(), alone)
        if parts and sensor in ("quadrature", "hall"):
            return with_last_tick(flow, spec)
        return with_last_tick(fitted(flow.whole(), alone.encoder), spec)

    if others.get("capture", ...) is None:
        refuse_without("--replay", _OPTIONS)
    return dict(read=read, **others)


CAPTURE_OPTIONS = Group(_OPTIONS, _read)
"""Handed over as `read`, which reads a capture for a spec, or for an axis of so many; in `parts` if it may."""


def _refuse_lines(log: str, given: dict[str, Any]) -> None:
    """Refuse options of lines where there is a count or an angle."""
    from tachometry.sim.captures.file import OptionError

    for name, value in given.items():
        if value is not None:
            raise OptionError(name, f"must not be given together with --{log}: a log of {log}s has no lines")


def _of_axis(line: str, text: str | None, axis: int, axes: int | None) -> str | None:
    """Return the channel of a line, or that of one of many axes; None: the reader's default."""
    if axes is None:
        return line if text is None and line == "z" else text
    if text is None:
        return f"{line}{axis}"
    channels = [word.strip() for word in text.split(",")]
    if len(channels) != axes:
        raise ValueError(f"--{line} must be {axes} channels with commas between, one for each axis, not {text!r}")
    return channels[axis]
