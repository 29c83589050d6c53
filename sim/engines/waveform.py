"""Waveforms are written as VCD, with a GTKWave save file that shows them as an engineer wants to see them."""

from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager
from heapq import merge
from operator import itemgetter
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from vcd import VCDWriter
from vcd.gtkw import GTKWFlag, GTKWSave

_SCOPE = "tachometer"
MOST_EDGES = 1 << 16  # clocks of a waveform that shows its clock

Change = tuple[int, str]  # picoseconds, and lines of the file
Curve = tuple[NDArray[np.float64], NDArray[np.float64]]  # times in seconds, and values from then on


class Waveform(AbstractContextManager["Waveform"]):
    """Writes sampled signals to `path`, and beside it a save file with the suffix `.gtkw`.

    Signals are those of the clock that begins at the time stamp; `clk` itself comes with `add_curves`, as it would be
    nearly all of a long file. Use as a context manager.

    - `widths`: Bits of each signal and whether it is signed, in the order in which they are shown.
    """

    def __init__(self, path: Path, clock_hz: int, widths: dict[str, tuple[int, bool]]) -> None:
        self._path, self._clock_hz, self._widths = path, clock_hz, widths
        self._file = path.open("w", newline="\n")
        self._writer = VCDWriter(self._file, timescale="1 ps", date="")
        # Registered as undefined: the first sample defines them.
        self._variables = [
            self._writer.register_var(_SCOPE, name, "wire", size=width, init="x") for name, (width, _) in widths.items()
        ]
        self._shifts = [sum(width for width, _ in list(widths.values())[:k]) for k in range(len(widths))]
        self._masks = [(1 << width) - 1 for width, _ in widths.values()]
        self._last: int | None = None
        self._time = 0

    def sample(self, clock: int, packed: int) -> None:
        """Write the signals in clock `clock`, packed in order, the first in the least significant bits."""
        changed = -1 if self._last is None else packed ^ self._last
        if changed:
            # Kept before it is written: Ctrl-C may come between.
            self._time = time = (clock * 10**12) // self._clock_hz
            for variable, shift, mask in zip(self._variables, self._shifts, self._masks, strict=True):
                if (changed >> shift) & mask:
                    self._writer.change(variable, time, (packed >> shift) & mask)
            self._last = packed

    def close(self, clock: int) -> None:
        """End the waveform at clock `clock`, or where it has come to, and write the save file."""
        self._writer.close(max((clock * 10**12) // self._clock_hz, self._time))
        self._file.close()
        with self._path.with_suffix(".gtkw").open("w", newline="\n") as file:
            save = GTKWSave(file)
            save.dumpfile(self._path.name, abspath=False)
            save.treeopen(f"{_SCOPE}.")
            save.signals_width(160)
            for name, (width, is_signed) in self._widths.items():
                trace = f"{_SCOPE}.{name}" + (f"[{width - 1}:0]" if width > 1 else "")
                if name in ("velocity", "position"):
                    flag = GTKWFlag.analog_step if name == "velocity" else GTKWFlag.analog_interpolated
                    save.trace(trace, datafmt="signed", extraflags=flag)
                    for _ in range(4):
                        save.blank(analog_extend=True)
                else:
                    save.trace(trace, datafmt="signed" if is_signed else "dec" if width > 1 else "bin")

    def __exit__(self, *_: object) -> None:
        self._file.close()


def add_curves(path: Path, clock_hz: int, window: tuple[int, int], curves: Mapping[str, Curve]) -> None:
    """Add real signals to a waveform and its save file, which show them as curves; and `clk`, if it is not too long."""
    begin, end = (clock * 10**12 // clock_hz for clock in window)
    added: list[Iterator[Change]] = []
    declared = []
    for name, (seconds, values) in curves.items():
        added.append(_values(name, np.rint(seconds * 1e12).astype(np.int64), values, begin, end))
        declared.append(f"$var real 64 {name} {name} $end\n")
    if window[1] - window[0] <= MOST_EDGES:
        edges = range(2 * window[0], 2 * window[1])
        added.append((edge * 10**12 // (2 * clock_hz), f"{1 - edge % 2}clk\n") for edge in edges)
        declared.insert(0, "$var wire 1 clk clk $end\n")
    head, _, body = path.read_text(encoding="ascii").partition("$upscope")
    with path.open("w", encoding="ascii", newline="\n") as file:
        last = -1
        file.write(f"{head}{''.join(declared)}$upscope{body.partition('#')[0]}")
        for time, text in merge(_changes(body), *added, key=itemgetter(0)):
            file.write(text if time == last else f"#{time}\n{text}")
            last = time
    with path.with_suffix(".gtkw").open("a", newline="\n") as file:
        save = GTKWSave(file)
        for name in curves:
            save.trace(f"{_SCOPE}.{name}", datafmt="real", extraflags=GTKWFlag.analog_step)
            for _ in range(4):
                save.blank(analog_extend=True)


def _values(name: str, time: NDArray[np.int64], values: NDArray[np.float64], begin: int, end: int) -> Iterator[Change]:
    """Yield values of a curve, the first of them that which holds at the begin."""
    first = max(int(np.searchsorted(time, begin, side="right")) - 1, 0)
    for at, value in zip(np.maximum(time[first:], begin).tolist(), values[first:].tolist(), strict=True):
        if at < end:
            yield at, f"r{value:.9g} {name}\n"


def _changes(body: str) -> Iterator[Change]:
    """Yield what a file of `Waveform` has behind its declarations."""
    for part in body.split("\n#")[1:]:
        time, _, text = part.partition("\n")
        yield int(time), f"{text}\n" if text and not text.endswith("\n") else text
