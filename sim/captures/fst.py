"""Compressed waveforms (`.fst`), as GTKWave, Icarus Verilog and Verilator write them, are read by pywellen."""

import importlib.util
import json
import os
import re
import struct
import sys
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from tachometry.sim.captures.file import NONE, CaptureError, Channel, OptionError, check_edges, reading
from tachometry.sim.captures.waveform import Changes, Variable
from tachometry.sim.signals.recording import MAX_EDGES, Recording
from tachometry.sim.signals.scratch import run_tool

_HEADER = struct.Struct(">BQQQ")  # type of the first block, its length, time of the beginning and of the end
_PLAIN, _PACKED = 0, 254  # types of it


def read_fst(
    path: str | os.PathLike[str],
    a: Channel | None = None,
    b: Channel | None = None,
    samplerate_hz: float | None = None,
    others: Mapping[str, Channel] = NONE,
) -> Recording:
    """Read two to four lines of an FST file: variables of one bit, or bits of vectors, as of `read_vcd`.

    Bit 0 of a vector is its last one, as pywellen does not tell how it was declared. It raises CaptureError if pywellen
    is not installed; if the file is missing, or damaged; for an unknown variable; if a line never is 0 or 1.
    """
    path = Path(path)
    if samplerate_hz is not None:
        raise OptionError("samplerate", f"must not be given for {path}: a waveform has its times")
    if importlib.util.find_spec("pywellen") is None:
        raise CaptureError(
            f"to read {path}, the extra `fst` must be installed: pip install 'tachometry[fst]'; or convert it with "
            f"`fst2vcd {path} -o {path.stem}.vcd`, which comes with GTKWave"
        )
    with reading(path), path.open("rb") as file:
        head = file.read(_HEADER.size)
    if len(head) < _HEADER.size or head[0] not in (_PLAIN, _PACKED):
        raise _damaged(path)
    known = _contents(path)
    if not known["unit"]:
        raise CaptureError(f"{path} must have a unit of its times")
    variables = [Variable(name, size, code, size - 1, 0) for code, (name, size) in enumerate(known["variables"])]
    changes = Changes(path, variables, a, b, others)
    codes = sorted(map(int, changes.codes))
    each = _contents(path, *codes)["changes"]
    check_edges(path, max(map(len, each)))
    *_, end = _HEADER.unpack(head)
    rows = [(time, code, value) for code, of in zip(codes, each, strict=True) for time, value in of]
    for time, code, value in sorted(rows, key=lambda row: row[0]):
        changes.at(time)
        changes.change(code, value)
    if head[0] == _PLAIN and end > max([row[0] for row in rows], default=-1):
        changes.at(end)
    factor, power = known["unit"]
    notes = [f"bit 0 of {variables[code].name} is its last one" for code in codes if variables[code].size > 1]
    return changes.recording(factor * Fraction(10) ** power, notes)


def _contents(path: Path, *codes: int) -> dict[str, Any]:
    """Return what another process finds in the file."""
    child = [sys.executable, "-P", "-m", "tachometry.sim.captures.fst_child"]
    done = run_tool([*child, str(path), str(MAX_EDGES + 1), *map(str, codes)])
    if done.returncode:
        reasons = re.findall(r"^\w+Error: (.*\w)", done.stderr, re.MULTILINE)  # a panic speaks of the reader's inside
        raise _damaged(path, *reasons[-1:])
    contents: dict[str, Any] = json.loads(done.stdout)
    return contents


def _damaged(path: Path, *reasons: str) -> CaptureError:
    return CaptureError(f"{path} must be a whole FST file, but is cut or damaged{''.join(f': {r}' for r in reasons)}")
