"""Waveforms are written as VCD, with a GTKWave save file that shows them as an engineer wants to see them."""

from pathlib import Path
from types import TracebackType

from vcd import VCDWriter
from vcd.gtkw import GTKWFlag, GTKWSave

_SCOPE = "tachometer"


class Waveform:
    """Writes sampled signals to `path`, and beside it a save file with the suffix `.gtkw`.

    Signals are those of the clock that begins at the time stamp; `clk` itself is left out, it would be nearly all of
    the file. Use as a context manager.

    Parameters
    ----------
    path : Path
    clock_hz : int
        Frequency of the clock in Hz.
    widths : dict of str to (int, bool)
        Bits of each signal and whether it is signed, in the order in which they are shown.
    """

    def __init__(self, path: Path, clock_hz: int, widths: dict[str, tuple[int, bool]]) -> None:
        self._path = path
        self._clock_hz = clock_hz
        self._widths = widths
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

    def __enter__(self) -> "Waveform":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._file.close()
