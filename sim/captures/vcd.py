"""Waveforms (`.vcd`) are read as captures: one-bit variables of a simulation or of a logic analyser's export."""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
from vcd.reader import ScopeDecl, Token, TokenKind, VarDecl, VCDParseError, tokenize

from tachometry.sim.captures.file import (
    NONE,
    CaptureError,
    Channel,
    OptionError,
    check_edges,
    choose_channels,
    named,
    reading,
)
from tachometry.sim.signals.recording import Recording

_LONGEST_NAME = 4096
_UNITS = {"s": 0, "ms": 3, "us": 6, "ns": 9, "ps": 12, "fs": 15}


def read_vcd(
    path: str | os.PathLike[str],
    a: Channel | None = None,
    b: Channel | None = None,
    samplerate_hz: float | None = None,
    others: Mapping[str, Channel] = NONE,
) -> Recording:
    """Read two to four one-bit variables of a Value Change Dump.

    The recording begins when all of them have first been 0 or 1, and ends with the last time in the file.

    Parameters
    ----------
    path : path
    a, b : str, int or None
        Name of the variable with its scopes, as `top.core.a`, else its number, from 0, among those of one bit. When not
        given: the variables whose names without scopes are a and b, if there is one of each, else the first two.
    samplerate_hz : None
        Not allowed: a waveform has its times.
    others : mapping of str to str or int
        Variables of further lines, `z` or `tick_in`, likewise; what is not given, the recording has not.

    Raises
    ------
    CaptureError
        If the file is missing, no VCD, or cut short; for an unknown variable; for a level other than 0 or 1 after the
        first of all.
    """
    path = Path(path)
    if samplerate_hz is not None:
        raise OptionError("samplerate", f"must not be given for {path}: a waveform has its times")
    with reading(path), path.open("rb") as file:
        _check_end(path, file)
        tokens = _tokens(path, file)
        names, codes, scale = _declarations(path, tokens)
        numbers = choose_channels(path, names, *_default(names, a, b), others)
        lines = dict(zip(("a", "b", *others), (codes[line.number] for line in numbers), strict=True))
        return named(_changes(path, tokens, lines, scale), names, numbers)


def _check_end(path: Path, file: BinaryIO) -> None:
    """Check that the last line is whole: of one that is cut, a part may read as another time or variable."""
    if file.seek(0, os.SEEK_END):
        file.seek(-1, os.SEEK_END)
        if not file.read(1).isspace():
            raise CaptureError(f"{path} must be a complete VCD file: its last line does not end")
    file.seek(0)


def _tokens(path: Path, file: BinaryIO) -> Iterator[Token]:
    try:
        yield from tokenize(file)
    except CaptureError:
        raise
    except (VCDParseError, ValueError) as error:
        raise CaptureError(f"{path} must be a complete VCD file: {str(error).splitlines()[0]}") from error


def _declarations(path: Path, tokens: Iterator[Token]) -> tuple[dict[int, str], list[str], tuple[int, int]]:
    """Return names and codes of all one-bit variables, and the time unit as a numerator and denominator in seconds."""
    scopes: list[str] = []
    names: dict[int, str] = {}
    codes: list[str] = []
    scale = None
    for token in tokens:
        data = token.data
        if token.kind is TokenKind.TIMESCALE:
            scale = (int(data.magnitude.value), 10 ** _UNITS[data.unit.value])
        elif isinstance(data, ScopeDecl):
            scopes.append(data.ident)
        elif token.kind is TokenKind.UPSCOPE and scopes:
            scopes.pop()
        elif isinstance(data, VarDecl) and data.size == 1:
            names[len(codes)] = ".".join([*scopes, data.ref_str])
            if len(names[len(codes)]) > _LONGEST_NAME:
                raise CaptureError(f"names of {path} with their scopes must have at most {_LONGEST_NAME} characters")
            codes.append(data.id_code)
        elif token.kind is TokenKind.ENDDEFINITIONS:
            if scale is None:
                raise CaptureError(f"{path} must have a $timescale")
            return names, codes, scale
    raise CaptureError(f"{path} must be a complete VCD file: its declarations do not end")


def _default(names: dict[int, str], a: Channel | None, b: Channel | None) -> tuple[Channel | None, Channel | None]:
    """Return what is not given, by the last part of the name, where that is unique."""

    def only(line: str) -> int | None:
        alike = [number for number, name in names.items() if name.rpartition(".")[2].casefold() == line]
        return alike[0] if len(alike) == 1 else None

    if only("a") is None or only("b") is None:
        return a, b
    return only("a") if a is None else a, only("b") if b is None else b


def _changes(path: Path, tokens: Iterator[Token], lines: dict[str, str], scale: tuple[int, int]) -> Recording:
    level = dict.fromkeys(lines.values(), "x")
    times: list[int] = []
    levels: list[tuple[str, ...]] = []
    distinct: dict[tuple[str, ...], tuple[str, ...]] = {}
    now = 0

    def note() -> None:
        row = tuple(level[code] for code in lines.values())
        if not times and not {*row} <= {"0", "1"}:
            return
        if not levels or row != levels[-1]:
            if not {*row} <= {"0", "1"}:
                raise CaptureError(f"levels of {path} must be 0 or 1, not {''.join(row)} at time {now}")
            times.append(now)
            levels.append(distinct.setdefault(row, row))
            check_edges(path, len(times))

    for token in tokens:
        if token.kind is TokenKind.CHANGE_TIME:
            note()
            if int(token.data) < now:
                raise CaptureError(
                    f"{path} line {token.span.start.line}: time must be at least {now}, not {token.data}"
                )
            now = int(token.data)
        elif token.kind is TokenKind.CHANGE_SCALAR:
            change = token.scalar_change
            if change.id_code in level:
                level[change.id_code] = change.value.lower()
        elif token.kind in (TokenKind.CHANGE_VECTOR, TokenKind.CHANGE_REAL) and token.data.id_code in level:
            level[token.data.id_code] = str(token.data.value).lower()
    note()
    if not times:
        raise CaptureError(f"{path} must contain the levels of all lines, 0 or 1, at least once")
    numerator, denominator = scale
    seconds = np.array([(time - times[0]) * numerator / denominator for time in times])
    columns = dict(zip(lines, np.array(levels, dtype=np.uint8).T, strict=True))
    return Recording(seconds, duration=(now - times[0]) * numerator / denominator, **columns)
