"""Captures of any kind: sigrok sessions (`.sr`), text (`.csv`, `.csv.gz`), waveforms (`.vcd`, `.fst`)."""

import functools
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Protocol, TypeVar

from tachometry.sim.captures.file import SAME, CaptureError, Channel, Channels, OptionError, is_stream, kind_of
from tachometry.sim.captures.fst import read_fst
from tachometry.sim.captures.header import PLAIN, TextOptions
from tachometry.sim.captures.sigrok import read_sr
from tachometry.sim.captures.text import read_csv
from tachometry.sim.captures.vcd import read_vcd
from tachometry.sim.signals.flow import Flow
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.source import Source
from tachometry.spec import CoreSpec

Held = TypeVar("Held", Recording, Flow)


class Reader(Protocol):
    """Describes a function that reads one kind of capture."""

    def __call__(self, path: Path, wanted: Channels, samplerate_hz: float | None, /) -> Flow: ...


TEXTS = (".csv", ".txt", ".tsv", ".teeth", ".msl")
PACKED = (*TEXTS, ".vcd")  # may end in .gz, too
READERS: dict[str, Reader] = {".sr": read_sr, ".vcd": read_vcd, ".fst": read_fst, **dict.fromkeys(TEXTS, read_csv)}
_LOOKED_AT = 16  # channels; each takes as long as the capture
# What other programs save for themselves, and how they write what others can read.
_EXPORTS = {
    ".sal": "in Saleae Logic 2: File, Export Data, CSV",
    ".logicdata": "in Saleae Logic 1: Options, Export data, CSV",
    ".bin": "in Saleae Logic 2, or in the oscilloscope: export as CSV instead of binary",
    ".dsl": "in DSView: File, Export, as .csv or .sr",
}


def _reader(path: Path, text: TextOptions) -> Callable[..., Flow]:
    """Return the reader of a file; it raises CaptureError if there is none, OptionError if it takes no such option."""
    kind = kind_of(path)
    reader = READERS.get(kind) if path.suffix.lower() != ".gz" or kind in PACKED else None
    if reader is None:
        how = f": export it {_EXPORTS[kind]}" if kind in _EXPORTS else ""
        raise CaptureError(
            f"a capture must be a .sr, .vcd, .fst, .csv, .txt, .tsv or .teeth file, or .csv.gz, not {path}{how}"
        )
    if reader is read_csv:
        return functools.partial(read_csv, options=text)
    of_times = dict(time=text.time, time_unit=text.unit, threshold=text.threshold)
    for name, value in (of_times | dict(pulse_times=text.pulse_times, pulse_periods=text.pulse_periods)).items():
        if value is not None:
            why = "it has levels" if name == "threshold" else "it has its times"
            raise OptionError(name, f"must not be given for {path}: {why}")
    return reader


def read_capture(
    path: str | os.PathLike[str],
    a: Channel | None = None,
    b: Channel | None = None,
    samplerate_hz: float | None = None,
    *,
    text: TextOptions = PLAIN,
    **others: Channel | None,
) -> Recording:
    """Read the encoder lines from a capture, whose kind its suffix gives.

    - `path`: A sigrok session `.sr` (see `read_sr`), a text `.csv`, `.txt`, `.tsv` or `.teeth`, or one of these with
      `.gz` (see `read_csv`), or a waveform `.vcd`, `.vcd.gz` or `.fst` (see `read_vcd` and `read_fst`).
    - `a`, `b`: Name of the channel, else its number from 0, as in sigrok's D0 to D7. When not given: the channels named
      A and B (in any case) if there are both, else the first two.
    - `samplerate_hz`, Hz: Only for a `.sr` or a text that has neither a samplerate nor times.
    - `text`: Only for a text, see `read_csv`.
    - `others`: Channels of `z`, the index line, of `tick_in`, the external tick, of `c`, a third line, and of `a_n`,
      the complement of A, and so on, likewise; what is not given, the recording has not.

    It raises CaptureError if the suffix is another one, or what the reader of that kind raises.
    """
    given = {name: channel for name, channel in others.items() if channel is not None}
    return read_parts(Path(path), Channels(a, b, given), samplerate_hz, text).whole()


def read_parts(path: Path, wanted: Channels, samplerate_hz: float | None, text: TextOptions) -> Flow:
    """Return a capture in parts, see `read_capture`."""
    reader = _reader(path, text)
    flow = reader(path, wanted, samplerate_hz)
    if not is_stream(path):
        flow.told = lambda source: _with_moving(source, lambda n: reader(path, Channels(n, SAME), samplerate_hz))
    return flow


def _with_moving(source: Source, read: Callable[[int], Flow]) -> Source:
    """Return a source that says which channels change that were not taken, if a line that was taken does not."""
    if not source.still:
        return source

    def moves(number: int) -> bool:
        try:
            return read(number).moves()
        except CaptureError:  # it is no line of levels
            return False

    moving = tuple(name for number, name in list(source.unused.items())[:_LOOKED_AT] if moves(number))
    return replace(source, moving=moving)


def with_last_tick(recording: Held, spec: CoreSpec) -> Held:
    """Return a list of edges with the tick of its last edge: the levels after it hold until the core has shown this
    tick.

    What ends later than with an edge ends where it says, and external ticks end with the capture.
    """
    if spec.tachometer.external_tick:
        return recording
    clocks = spec.latency.pin_to_count + spec.tick.longest + spec.latency.tick + spec.latency.tick_to_velocity
    # One clock more for the edge, which is seen at the next one, and one for rounding.
    tail_s = (clocks + 2) / spec.timing.clock_hz
    if isinstance(recording, Flow):
        recording.tail_s = tail_s
    elif recording.duration <= recording.time[-1]:
        return replace(recording, duration=recording.duration + tail_s)
    return recording
