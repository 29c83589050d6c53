"""Every kind of capture shares this: its error, the choice of channels, and files written whole or not at all."""

import difflib
import functools
import gzip
import itertools
import re
import stat
import sys
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from io import BufferedReader
from pathlib import Path
from typing import Any, NamedTuple, cast

from tachometry.sim.signals.files import replacing
from tachometry.sim.signals.flow import Flow, Parts
from tachometry.sim.signals.recording import MAX_EDGES
from tachometry.sim.signals.source import Source
from tachometry.spec.language.option import ParameterError

Channel = str | int
SAME = -(1 << 16)  # as the channel of B: that of A
_LISTED = 40  # channels in a message
STDIN = Path("-")
NO_VECTORS: Mapping[int, str] = {}


class Line(NamedTuple):
    """Names a line of a capture."""

    number: int  # of its channel
    bit: int | None = None  # of the number that the channel is; None: it is a level


@dataclass(frozen=True)
class Channels:
    """Channels of the lines that are read, each by its name or number; None: see `choose_channels`."""

    a: Channel | None = None
    b: Channel | None = None
    others: Mapping[str, Channel] = field(default_factory=dict)  # by the names of further lines

    @property
    def lines(self) -> tuple[str, ...]:
        """Names of the lines."""
        return "a", "b", *self.others


ANY = Channels()


class CaptureError(ValueError):
    """A capture cannot be read or written; the message is one line, with what is wrong and what is allowed."""


class OptionError(CaptureError, ParameterError):
    """An option does not go with a capture; the command line names it as it was given."""


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn the errors of the file system while `path` is read into a `CaptureError`."""
    try:
        yield
    except FileNotFoundError:
        raise CaptureError(f"{path} does not exist") from None
    except (OSError, EOFError, zlib.error) as error:
        raise CaptureError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from error


def kind_of(path: Path) -> str:
    """Return the suffix that names the kind of a file, in lower case: the one before `.gz`; `.csv` for a bare pipe, but
    `.vcd` if what comes to the standard input begins as one.
    """
    if path == STDIN and opened_bytes(path).peek(1)[:1] == b"$":
        return ".vcd"
    named = (path.with_suffix("") if path.suffix.lower() == ".gz" else path).suffix.lower()
    return ".csv" if not named and is_stream(path) else named


def is_stream(path: Path) -> bool:
    """Return whether a path is a pipe or a device: it is read once, from its beginning to its end."""
    if path == STDIN:
        return True
    try:
        mode = path.stat().st_mode
    except (OSError, ValueError):  # its reader refuses it
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def check_regular(path: Path) -> None:
    """Check that a capture of which a reader needs any part at any time, or its size, is a regular file."""
    if is_stream(path):
        kinds = ".csv, .txt, .tsv, .teeth and .vcd, also with .gz,"
        raise CaptureError(f"{path} must be a regular file: only {kinds} are read from a pipe or a device")


def opened_bytes(path: Path) -> BufferedReader:
    """Open a file; what ends in `.gz` is unpacked."""
    if path == STDIN:
        return cast(BufferedReader, sys.stdin.buffer)
    return cast(BufferedReader, gzip.open(path)) if path.suffix.lower() == ".gz" else path.open("rb")


def check_edges(path: Path, n: int) -> None:
    """Check that a capture has no more changes than a recording may have."""
    if n > MAX_EDGES:
        raise CaptureError(f"{path} must have at most {MAX_EDGES} changes of the lines, and has more")


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Give a path to write to, which takes the place of `path` when all is written (see `sim.files.replacing`)."""
    try:
        with replacing(path) as beside:
            yield beside
    except OSError as error:
        raise CaptureError(f"cannot write {path}: {error.strerror or error}") from error


def _listed(texts: Sequence[str]) -> str:
    """Return the names of channels for a message, not too many."""
    return ", ".join(texts[:_LISTED]) + (f" and {len(texts) - _LISTED} more" if len(texts) > _LISTED else "")


def _find(channels: Mapping[int, str], vectors: Mapping[int, str], wanted: Channel | None) -> Line | None:
    """Return the line of a channel, or None if there is none of this name or number."""
    if not isinstance(wanted, str):
        return Line(wanted) if wanted is not None and wanted in channels else None
    if (number := _named(channels, wanted)) is not None:
        return Line(number)
    bit = re.fullmatch(r"(.+?)\[?([0-9]{1,7})\]?", wanted)  # a0 of one axis is a[0] of many in a waveform
    if bit and (number := _named(vectors, bit[1])) is not None:
        return Line(number, int(bit[2]))
    return _find(channels, vectors, int(wanted)) if wanted.isascii() and wanted.isdigit() else None


def choose_channels(
    path: Path, channels: Mapping[int, str], wanted: Channels, vectors: Mapping[int, str] = NO_VECTORS
) -> tuple[Line, ...]:
    """Return the encoder lines among the channels of a capture: A, B and others, by their names.

    A line is given by the name of its channel (in this spelling, else in any case, else without its scopes), else by
    its number, from 0. A and B, when not given, are the channels named A and B if there are both, else the first two;
    with `SAME` for b there need not be two. Of `vectors`, which are numbers, `name[1]`, or `name1` if there is no such
    channel, is bit 1. It raises CaptureError if there are too few channels, one is unknown, or two are the same.
    """
    texts = [f"{name} ({number})" for number, name in channels.items()]
    texts += [f"{name}[bit]" for number, name in vectors.items() if number not in channels]
    listed, one_line, a, b = _listed(texts), wanted.b == SAME, wanted.a, wanted.b
    if len(channels) < 2 - one_line and not (vectors and str(a).endswith("]")):
        needed = "one logic channel" if one_line else "two logic channels"
        example = next(iter(vectors.values()), None)
        hint = f"; lines in one number are --a {example}[0] --b {example}[1]" if example and not one_line else ""
        raise CaptureError(f"{path} must have at least {needed}, not {listed or 'none'}{hint}")
    find = functools.partial(_find, channels, vectors)
    named = [line and line.number for line in (find("A"), find("A" if one_line else "B"))]
    defaults = [*channels, *channels, None, None][:2] if None in named else named
    first, second = (default if given is None else given for default, given in zip(defaults, (a, b), strict=True))
    lines: dict[str, Line] = {}
    for line, channel in {"a": first, "b": first if one_line else second, **wanted.others}.items():
        if (place := find(channel)) is None:
            near = difflib.get_close_matches(str(channel), texts, 3, 0.5) if len(texts) > _LISTED else []
            close = f"; near it are {', '.join(near)}" * bool(near)
            if line.endswith("_n"):
                raise CaptureError(f"{path} must have a channel {line} with --differential, not only {listed}{close}")
            raise CaptureError(f"channel {line} of {path} must be one of {listed}, not {channel!r}{close}")
        lines[line] = place
    for one, other in itertools.combinations(lines, 2):
        if (place := lines[one]) == lines[other] and not (one_line and other == "b"):
            both = channels[place.number] if place.bit is None else f"{vectors[place.number]}[{place.bit}]"
            raise CaptureError(f"channels {one} and {other} of {path} must be two of {listed}, not both {both}")
    return tuple(lines.values())


def _named(channels: Mapping[int, str], wanted: str) -> int | None:
    """Return the number of a channel: of this spelling, else in any case, else the only one without its scopes."""
    exact = [number for number, name in channels.items() if name == wanted]
    alike = [number for number, name in channels.items() if name.casefold() == wanted.casefold()]
    last = [number for number, name in channels.items() if name.rpartition(".")[2].casefold() == wanted.casefold()]
    return (exact or alike or last)[0] if exact or alike or len(last) == 1 else None


def flow_of(path: Path, wanted: Channels, parts: Parts) -> Flow:
    """Return the recording of a file that comes in parts."""
    flow = Flow(wanted.lines, parts, functools.partial(check_edges, path))
    with suppress(OSError, ValueError):
        flow.size = path.stat().st_size
    return flow


def position(file: Any) -> int:
    """Return how many bytes of a file have been read, before they are unpacked; 0 of a pipe."""
    file = getattr(file, "fileobj", file)
    return int(file.tell()) if file.seekable() else 0


def source_of(
    wanted: Channels, channels: Mapping[int, str], lines: Sequence[Line], notes: Sequence[str] = ()
) -> Source:
    """Return which channels the lines are that were wanted; a `Flow` adds what is counted."""
    names = [channels[number] + ("" if bit is None else f"[{bit}]") for number, bit in lines]
    numbers = {line.number for line in lines}
    unused = {number: name for number, name in channels.items() if number not in numbers}
    return Source(dict(zip(wanted.lines, names, strict=True)), 0.0, -1, unused=unused, notes=tuple(notes))
