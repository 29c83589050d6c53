"""Compressed waveforms (`.fst`), as GTKWave, Icarus Verilog and Verilator write them, are read by pywellen."""

import importlib.util
import json
import os
import re
import struct
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import IO, Any, cast

from tachometry.sim.captures.file import ANY, CaptureError, Channels, OptionError, check_regular, flow_of, reading
from tachometry.sim.captures.waveform import Changes, Names, Variable
from tachometry.sim.signals.flow import Flow, Parts
from tachometry.sim.signals.temporary import running, scratch

_HEADER = struct.Struct(">BQQQ")  # type of the first block, its length, time of the beginning and of the end
_PLAIN, _PACKED = 0, 254  # types of it
# Limits of the process that reads a file, which may be packed a thousand times as tightly: seconds, bytes of its memory
# (some 20 for each change of a block), and characters of all names and of one change that it prints, and of its errors.
_LONGEST, _MOST_MEMORY, _MOST_NAMES, _MOST_CHANGE, _MOST_ERRORS = 600.0, 2 << 30, 1 << 24, 1 << 16, 1 << 16
_TOO_MUCH = 3  # exit status of one that would print more
_CHILD = [sys.executable, "-P", "-m", "tachometry.sim.captures.fst_child"]
_CHANGE = re.compile(r"(\d+) (\d+) (.*)\n")


def _head(path: Path, samplerate_hz: float | None) -> bytes:
    """Return the head of a file; it raises CaptureError if it has none, or cannot be read here."""
    if samplerate_hz is not None:
        raise OptionError("samplerate", f"must not be given for {path}: a waveform has its times")
    if importlib.util.find_spec("pywellen") is None:
        raise CaptureError(
            f"to read {path}, the extra `fst` must be installed: pip install 'tachometry[fst]'; or convert it with "
            f"`fst2vcd {path} -o {path.stem}.vcd`, which comes with GTKWave"
        )
    check_regular(path)
    with reading(path), path.open("rb") as file:
        head = file.read(_HEADER.size)
    if len(head) < _HEADER.size or head[0] not in (_PLAIN, _PACKED):
        raise _damaged(path)
    return head


def read_fst(path: str | os.PathLike[str], wanted: Channels = ANY, samplerate_hz: float | None = None) -> Flow:
    """Read two to four lines of an FST file: variables of one bit, or bits of vectors, as of `read_vcd`.

    Bit 0 of a vector is its last one, as pywellen does not tell how it was declared. It raises CaptureError if pywellen
    is not installed; if the file is missing, damaged, or beyond the limits above; for an unknown variable; if a line
    never is 0 or 1.
    """
    path = Path(path)
    return flow_of(path, wanted, _parts(path, wanted, _head(path, samplerate_hz)))


def _parts(path: Path, wanted: Channels, head: bytes) -> Parts:
    known: dict[str, Any] = json.loads("".join(_printed(path)))
    if not known["unit"]:
        raise CaptureError(f"{path} must have a unit of its times")
    names = Names(path)
    for name, _ in known["variables"]:
        names.add(name)
    variables = [Variable(name, size, code, size - 1, 0) for code, (name, size) in enumerate(known["variables"])]
    factor, power = known["unit"]
    changes = Changes(path, variables, wanted, factor * Fraction(10) ** power)
    codes = sorted(map(int, changes.codes))
    *_, end = _HEADER.unpack(head)
    time, size = -1, path.stat().st_size
    if head[0] == _PLAIN:
        changes.position = lambda: min(time, end) * size // max(end, 1)
    for line in _printed(path, *codes):
        if row := _CHANGE.fullmatch(line):
            time = int(row[1])
            yield from changes.at(time)
            changes.change(int(row[2]), row[3])
    if head[0] == _PLAIN and end > time:
        yield from changes.at(end)
    notes = [f"bit 0 of {variables[code].name} is its last one" for code in codes if variables[code].size > 1]
    return (yield from changes.end(notes))


def _printed(path: Path, *codes: int) -> Iterator[str]:
    """Yield the lines that another process prints, which reads the file, see `fst_child`."""
    most = _MOST_CHANGE if codes else _MOST_NAMES
    with tempfile.TemporaryFile() as errors, scratch() as folder:
        words = [*_CHILD, str(_LONGEST), str(path), str(folder), str(most), *map(str, codes)]
        try:
            with running(words, seconds=_LONGEST, memory=_MOST_MEMORY, errors=errors) as child:
                cast(IO[str], child.stdin).close()
                yield from cast(IO[str], child.stdout)
        except subprocess.TimeoutExpired:
            raise _too_large(path, f"{_LONGEST:g} s") from None
        errors.seek(max(errors.seek(0, os.SEEK_END) - _MOST_ERRORS, 0))
        said = errors.read().decode(errors="replace")
    if child.returncode == _TOO_MUCH:
        raise _too_large(path, f"{most} characters for {'a change' if codes else 'its names'}")
    if child.returncode and said.startswith("Timeout"):
        raise _too_large(path, f"{_LONGEST:g} s")
    if child.returncode and re.search(r"MemoryError|memory allocation", said):
        raise _too_large(path, f"{_MOST_MEMORY} bytes of memory")
    if child.returncode:
        reasons = re.findall(r"^\w+Error: (.*\w)", said, re.MULTILINE)  # a panic speaks of the reader's inside
        raise _damaged(path, *reasons[-1:])


def _too_large(path: Path, limit: str) -> CaptureError:
    return CaptureError(
        f"{path} needs more than {limit}: dump only the lines of the encoder, or convert it with `fst2vcd {path} -o "
        f"{path.stem}.vcd`, as a .vcd of any length can be read"
    )


def _damaged(path: Path, *reasons: str) -> CaptureError:
    return CaptureError(f"{path} must be a whole FST file, but is cut or damaged{''.join(f': {r}' for r in reasons)}")
