"""Waveforms (`.vcd`) are read as captures: variables of a simulation or of a logic analyser's export."""

import os
import re
from collections.abc import Generator, Iterator
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import BinaryIO

from tachometry.sim.captures.file import (
    ANY,
    CaptureError,
    Channels,
    OptionError,
    flow_of,
    opened_bytes,
    position,
    reading,
)
from tachometry.sim.captures.waveform import Changes, Names, Variable
from tachometry.sim.signals.flow import Flow, Part, Parts

_PIECE = 1 << 20  # bytes read at once
_LONGEST = 1 << 16  # bytes of a word
_LONGEST_NAME = 4096
_LATEST = 20  # digits of a time
_MOST_WORDS = 1000  # that are kept of a declaration
_UNITS = {"s": 0, "ms": 3, "us": 6, "ns": 9, "ps": 12, "fs": 15}
_NO_BITS = (b"real", b"realtime", b"shortreal", b"string", b"event")  # types of variables
_SCALARS, _WITH_BLANK = b"01xXzZuUwWlLhH-", b"bBrRsS"  # how changes begin, of one bit and of what has a blank in it
_SECTIONS = (b"$dumpvars", b"$dumpall", b"$dumpon", b"$dumpoff", b"$end")


def read_vcd(path: str | os.PathLike[str], wanted: Channels = ANY, samplerate_hz: float | None = None) -> Flow:
    """Read two to four lines of a Value Change Dump: variables of one bit, or bits of vectors.

    The recording begins when all of them have first been 0 or 1, and ends with the last time in the file. Where a line
    is x or z after that, its level before holds.

    A channel is the name of a variable with its scopes, as `top.core.a`, or `top.enc[0]` for a bit of a vector as it is
    declared; else its number, from 0, among those of one bit. When not given: the variables whose names without scopes
    are a and b, if there is one of each, else the first two. The other arguments are as of `read_sr`.

    It raises CaptureError if the file is missing, no VCD, or cut short; for an unknown variable; if a line never is 0
    or 1.
    """
    path = Path(path)
    if samplerate_hz is not None:
        raise OptionError("samplerate", f"must not be given for {path}: a waveform has its times")
    return flow_of(path, wanted, _parts(path, wanted))


def _parts(path: Path, wanted: Channels) -> Parts:
    with reading(path), opened_bytes(path) as file:
        words = _Words(path, file)
        variables, codes, unit = _declarations(path, words)
        changes = Changes(path, variables, wanted, unit)
        changes.position = partial(position, file)
        last = yield from _read_changes(path, words, codes, changes)
        return (yield from changes.end(words.end_notes(last, codes)))


class _Words:
    """Gives the words of a file, and knows how it ends."""

    def __init__(self, path: Path, file: BinaryIO) -> None:
        self._path, self._file = path, file
        self._ended = True
        self.rest = self._all()

    def _all(self) -> Iterator[bytes]:
        tail = self._file.read(3).removeprefix(b"\xef\xbb\xbf")
        while piece := self._file.read(_PIECE):
            text = tail + piece
            self._ended = text.endswith(b"\n")
            words = text.split()
            # The last word may go on in the next piece.
            tail = b"" if text[-1:].isspace() or not words else words.pop()
            if len(tail) > _LONGEST:
                raise CaptureError(f"words of {self._path} must have at most {_LONGEST} bytes")
            yield from words
        yield from tail.split()

    def until_end(self, what: str) -> list[bytes]:
        """Return the words before `$end`; of many, the first ones."""
        found: list[bytes] = []
        for word in self.rest:
            if word == b"$end":
                return found
            if len(found) < _MOST_WORDS:
                found.append(word)
        raise _incomplete(self._path, f"{what} does not end")

    def end_notes(self, last: bytes, codes: set[bytes]) -> list[str]:
        """Return what there is to say of the last line; CaptureError if the code in it may be a part of another."""
        if self._ended:
            return []
        if last and any(code != last and code.startswith(last) for code in codes):
            raise CaptureError(
                f"the last line of {self._path} must end, else its last change may be cut: put a line end there if it "
                "is whole"
            )
        return ["the last line does not end: if the file was cut, what followed is missing"]


def _incomplete(path: Path, why: str) -> CaptureError:
    return CaptureError(f"{path} must be a complete VCD file: {why}")


def _shown(word: bytes) -> str:
    text = word.decode("utf-8", "replace")
    return repr(text if len(text) <= 40 else text[:40] + "...")


def _declarations(path: Path, words: _Words) -> tuple[list[Variable], set[bytes], Fraction]:
    """Return all variables that have bits, the codes of all, and the unit of the times in seconds."""
    scopes: list[str] = []
    variables: list[Variable] = []
    codes: set[bytes] = set()
    unit: Fraction | None = None
    names = Names(path)
    for word in words.rest:
        if word[:1] != b"$" or word == b"$end":
            raise _incomplete(path, f"{_shown(word)} must be a declaration, such as $var")
        said = words.until_end(word.decode("utf-8", "replace"))
        if word == b"$timescale":
            unit = _unit(path, said)
        elif word == b"$scope":
            scopes.append(said[-1].decode("utf-8", "replace") if len(said) == 2 else "")
            _check_length(path, ".".join(scopes))
        elif word == b"$upscope" and scopes:
            scopes.pop()
        elif word == b"$var":
            if len(said) > 2 and (glued := re.fullmatch(rb"([0-9]{1,7})([^0-9]\S*)", said[1])):
                said[1:2] = glued.groups()  # without the blank between size and code
            variable = _variable(path, said, scopes)
            names.add(variable.name, said[2])
            codes.add(said[2])
            variables += [] if said[0] in _NO_BITS else [variable]
        elif word == b"$enddefinitions":
            if unit is None:
                raise CaptureError(f"{path} must have a $timescale, such as $timescale 1 ns $end")
            return variables, codes, unit
    raise _incomplete(path, "its declarations do not end")


def _unit(path: Path, said: list[bytes]) -> Fraction:
    match = re.fullmatch(rb"(1|10|100)([munpf]?s)", b"".join(said))
    if match is None:
        raise CaptureError(
            f"$timescale of {path} must be 1, 10 or 100 s, ms, us, ns, ps or fs, not {_shown(b' '.join(said))}"
        )
    return Fraction(int(match[1]), 10 ** _UNITS[match[2].decode()])


def _variable(path: Path, said: list[bytes], scopes: list[str]) -> Variable:
    """Return the variable of a declaration: type, size, code, name, and bits that may be part of the name."""
    if len(said) < 4 or not re.fullmatch(rb"[0-9]{1,7}", said[1]):
        slip = ": a blank is missing between two of them" if len(said) == 3 else ""
        shown = f"{_shown(b' '.join(said))}{slip}"
        raise _incomplete(path, f"$var must have a type, a size, a code and a name, not {shown}")
    size, own = int(said[1]), b"".join(said[3:]).decode("utf-8", "replace")
    name, high, low = own, size - 1, 0
    if size > 1 and (match := re.fullmatch(r"(.+)\[([0-9]{1,7}):([0-9]{1,7})\]", own)):
        name, high, low = match[1], int(match[2]), int(match[3])
        if abs(high - low) + 1 != size:
            raise CaptureError(f"{own} of {path} must have as many bits as its declaration says, {size}")
    name = ".".join([*scopes, name])
    _check_length(path, name)
    return Variable(name, size, said[2], high, low)


def _check_length(path: Path, name: str) -> None:
    if len(name) > _LONGEST_NAME:
        raise CaptureError(f"names of {path} with their scopes must have at most {_LONGEST_NAME} characters")


def _read_changes(path: Path, words: _Words, codes: set[bytes], changes: Changes) -> Generator[Part, None, bytes]:
    """Read all changes; return the code in the last one, or nothing if a time or a section came later."""
    wanted, now, code = changes.codes, b"0", b""
    for word in words.rest:
        head, code, value = word[:1], word[1:], word[:1]
        if head == b"#":
            now, code = code, b""
            if len(now) > _LATEST or not re.fullmatch(rb"[0-9]+(\.[0-9]+)?", now):
                raise _incomplete(path, f"{_shown(word)} must be # and a time of at most {_LATEST} digits")
            yield from changes.at(int(now) if now.isdigit() else Fraction(now.decode()))
            continue
        if head == b"$":
            code = b""
            if word not in _SECTIONS:
                words.until_end(_shown(word))
            continue
        if head in _WITH_BLANK:
            value, code = code, next(words.rest, b"")
        if code not in codes or head not in _SCALARS + _WITH_BLANK:
            raise _incomplete(
                path, f"{_shown(word)} at time {now.decode()} must be a change of a variable that it declares"
            )
        if code in wanted:
            changes.change(code, value.decode("utf-8", "replace"))
    return code
