"""sigrok sessions (`.sr`), as sigrok-cli and PulseView save them, are read as a recording and written from a
`PinTrace`.

The format is described at https://sigrok.org/wiki/File_format:Sigrok/v2. Both ways work chunk by chunk, never with
the whole of a capture.
"""

import io
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import (
    ANY,
    CaptureError,
    Channels,
    check_regular,
    choose_channels,
    flow_of,
    reading,
    source_of,
    writing,
)
from tachometry.sim.signals.axes import AxesTrace, Trace
from tachometry.sim.signals.flow import ROWS, Flow, Part, Parts
from tachometry.sim.signals.recording import packed

CHUNK = 4 << 20  # bytes, as sigrok cuts its own
# Limits of a session, which may be packed a thousand times as tightly: bytes of the list of members, of the metadata,
# and of all samples. Samples take no memory, their changes do.
_MOST_LISTED = 16 << 20
_MOST_METADATA = 1 << 20
_MOST_SAMPLES = 1 << 36
UNIT_HZ = {"": 1, "k": 10**3, "m": 10**6, "g": 10**9}
# What zipfile raises for a damaged file: besides its own error, those of the layers below, by what is damaged.
ZIP_ERRORS = (zipfile.BadZipFile, zlib.error, struct.error, EOFError, NotImplementedError, RuntimeError, ValueError)


def read_sr(
    path: str | os.PathLike[str],
    wanted: Channels = ANY,
    samplerate_hz: float | None = None,
    *,
    _piece: int = CHUNK >> 2,
) -> Flow:
    """Read two to four channels of a sigrok session, version 1 or 2.

    Sample k is taken at k / samplerate; a change is dated at the first sample that shows it, and the duration is the
    number of samples / samplerate. Change times are rounded down to float64 and the duration up, hence
    `Recording.place` on a clock that is a multiple of the samplerate finds sample k at clock k * multiple, exactly.

    A channel is a name or a number: N is sigrok's D<N>, bit N of a sample. The other arguments are as of
    `read_capture`. It raises CaptureError if the file is none, for an unknown channel, or for a samplerate that is
    missing or is not the one in the file.
    """
    path = Path(path)
    if samplerate_hz is not None and not 0 < samplerate_hz < float("inf"):
        raise CaptureError(f"samplerate must be above 0 Hz and finite, not {samplerate_hz} Hz")
    check_regular(path)
    return flow_of(path, wanted, _parts(path, wanted, samplerate_hz, _piece))


def _parts(path: Path, wanted: Channels, samplerate_hz: float | None, piece: int) -> Parts:
    """Yield samples that differ from the one before: the first always does."""
    with reading(path), _damage_named(path), _Bounded(path) as file, zipfile.ZipFile(file) as archive:
        session = _read_session(path, archive)
        rate = agreed_samplerate(path, session.samplerate_hz, samplerate_hz)
        lines = choose_channels(path, session.channels, wanted)
        before: NDArray[np.integer[Any]] = np.full(1, -1, np.int16)
        n_samples, time, level = 0, [np.empty(0)], [np.empty(0, np.uint8)]
        for data in _pieces(path, archive, session, piece):
            now = packed([data[:, line.number // 8] >> np.uint8(line.number % 8) & np.uint8(1) for line in lines])
            changed = np.flatnonzero(np.append(before, now[:-1]) != now)
            time.append(divide(changed + n_samples, rate, up=False))
            level.append(now[changed])
            before, n_samples = now[-1:], n_samples + len(now)
            if sum(map(len, level)) >= ROWS:
                until = float(divide(np.array([n_samples]), rate, up=False)[0])
                yield Part(np.concatenate(time), np.concatenate(level), until, file.tell())
                time, level = time[:1], level[:1]
        if n_samples == 0:
            raise CaptureError(f"{path} must have at least one sample, not 0")
        duration = float(divide(np.array([n_samples]), rate, up=True)[0])
        yield Part(np.concatenate(time), np.concatenate(level), duration, file.tell())
        return source_of(wanted, session.channels, lines)


def write_sr(path: str | os.PathLike[str], trace: Trace, clock_hz: int, *, _chunk: int = CHUNK) -> None:
    """Write a trace as a sigrok session of version 2, channels A, B and the others that there are, one sample a clock.

    Of many axes the channels are A0, B0, then those of axis 1, and so on.

    Equal traces give equal files, byte for byte, with the same zlib. Read back and placed on the same clock, which is
    the samplerate, the file gives the same trace. It takes its new content only when all is written. CaptureError if it
    cannot be; ValueError if `clock_hz` or the number of clocks is below 1.
    """
    if clock_hz < 1:
        raise ValueError(f"clock_hz must be at least 1, not {clock_hz}")
    if trace.n_clocks < 1:
        raise ValueError(f"n_clocks must be at least 1, not {trace.n_clocks}")
    if isinstance(trace, AxesTrace):
        level, channels = trace.levels, [_channel(axis, name) for axis, name in trace.names]
    else:
        level, channels = trace.level.reshape(-1, 1), [name.upper() for name in trace.wires]
    with writing(Path(path)) as beside, zipfile.ZipFile(beside, "w") as archive:
        archive.writestr(_member("version"), "2")
        archive.writestr(_member("metadata"), _metadata(clock_hz, channels))
        for number, first in enumerate(range(0, trace.n_clocks, _chunk), 1):
            end = min(first + _chunk, trace.n_clocks)
            row = int(np.searchsorted(trace.clock, first, "right")) - 1  # the row that holds at `first`
            row_end = int(np.searchsorted(trace.clock, end, "left"))
            starts = np.maximum(trace.clock[row:row_end], first)
            samples = np.repeat(level[row:row_end], np.diff(starts, append=end), axis=0)
            archive.writestr(_member(f"logic-1-{number}"), samples.tobytes(), zipfile.ZIP_DEFLATED)


def _member(name: str) -> zipfile.ZipInfo:
    """Return a member without the time, and with the same attributes on every system."""
    member = zipfile.ZipInfo(name)  # 1980-01-01, the earliest that a zip file can tell
    member.create_system = 3  # Unix
    return member


def _metadata(samplerate_hz: int, channels: list[str]) -> str:
    # In the largest unit that leaves an integer: older sigroks do not read fractions.
    unit, prefix = next(
        (hz, p) for hz, p in ((10**9, "G"), (10**6, "M"), (10**3, "k"), (1, "")) if not samplerate_hz % hz
    )
    lines = [
        "[global]",
        "sigrok version=0.5.2",  # the libsigrok whose format this is
        "",
        "[device 1]",
        "capturefile=logic-1",
        f"total probes={len(channels)}",
        f"samplerate={samplerate_hz // unit} {prefix}Hz",
        "total analog=0",
        *(f"probe{number}={name}" for number, name in enumerate(channels, 1)),
        f"unitsize={-(-len(channels) // 8)}",
    ]
    return "\n".join(lines) + "\n"


class _Bounded(io.FileIO):
    """Bounds a file of which `zipfile` reads the list of members at once, before anything else is known of it."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > max(_MOST_LISTED, CHUNK):
            raise CaptureError(f"the list of members of {self.name} must have at most {_MOST_LISTED} bytes, not {size}")
        return super().read(size)


def _small(path: Path, archive: zipfile.ZipFile, name: str) -> bytes:
    """Return a member that is read at once."""
    if (size := archive.getinfo(name).file_size) > _MOST_METADATA:
        raise CaptureError(f"{name} of {path} must have at most {_MOST_METADATA} bytes, not {size}")
    return archive.read(name)


@dataclass(frozen=True)
class _Session:
    path: Path
    channels: dict[int, str]  # bit of a sample: name
    unitsize: int  # bytes a sample
    samplerate_hz: float | None
    members: list[zipfile.ZipInfo]  # the samples, in order


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    try:
        yield
    except CaptureError:
        raise
    except ZIP_ERRORS as error:
        reason = " ".join(str(error).split()) or "it ends early"
        raise CaptureError(
            f"{path} must be a whole sigrok session (a zip file), but is cut or damaged: {reason}"
        ) from error


def _read_session(path: Path, archive: zipfile.ZipFile) -> _Session:
    names = set(archive.namelist())
    for needed in ("version", "metadata"):
        if needed not in names:
            raise CaptureError(f"{path} must be a sigrok session, but has no member {needed!r}")
    version = _small(path, archive, "version").strip()
    if version not in (b"1", b"2"):
        raise CaptureError(f"version of sigrok session {path} must be 1 or 2, not {version.decode('latin-1')!r}")
    ini = _metadata_of(path, archive)
    devices = [ini[name] for name in ini if name.startswith("device ") and "capturefile" in ini[name]]
    if not devices:
        raise CaptureError(f"{path} must have logic samples, but its metadata names no capturefile")
    device = devices[0]
    unitsize = device.get("unitsize", "none").strip()
    if unitsize not in set("12345678"):
        raise CaptureError(f"unitsize of {path} must be 1 to 8 bytes, not {unitsize}")
    probes = sorted((int(m[1]), name) for key, name in device.items() if (m := re.fullmatch(r"probe([0-9]{1,3})", key)))
    for number, _ in probes:
        if not 1 <= number <= 8 * int(unitsize):
            raise CaptureError(f"probes of {path} must be 1 to {8 * int(unitsize)} (unitsize {unitsize}), not {number}")
    channels = {number - 1: name.strip() or f"D{number - 1}" for number, name in probes}
    members = _members(path, archive, device["capturefile"].strip())
    return _Session(path, channels, int(unitsize), parse_samplerate(path, device.get("samplerate")), members)


def _metadata_of(path: Path, archive: zipfile.ZipFile) -> dict[str, dict[str, str]]:
    """Return the sections of the metadata; a parser of the library takes a time that is quadratic in blanks."""
    sections: dict[str, dict[str, str]] = {}
    section: dict[str, str] | None = None
    try:
        lines = _small(path, archive, "metadata").decode().splitlines()
    except UnicodeDecodeError as error:
        raise CaptureError(f"metadata of {path} must be an INI text: {error}") from error
    for number, line in enumerate(map(str.strip, lines), 1):
        key, equals, value = line.partition("=")
        key = key.strip().lower()
        if line.startswith("[") and line.endswith("]") and line[1:-1] not in sections:
            section = sections.setdefault(line[1:-1], {})
        elif section is not None and equals and key and key not in section:
            section[key] = value.strip()
        elif line and not line.startswith("#"):
            raise CaptureError(f"metadata of {path} must be an INI text: line {number} must not be {line[:60]!r}")
    return sections


def _members(path: Path, archive: zipfile.ZipFile, capturefile: str) -> list[zipfile.ZipInfo]:
    if capturefile in archive.namelist():
        members = [archive.getinfo(capturefile)]
    else:
        pattern = re.compile(re.escape(capturefile) + "-([0-9]+)")
        named = [(int(m[1]), info) for info in archive.infolist() if (m := pattern.fullmatch(info.filename))]
        chunks = dict(named)
        if len(chunks) < len(named):
            raise CaptureError(
                f"chunks of {path} must be members with a number each, but two of {capturefile} share one"
            )
        if not chunks:
            raise CaptureError(f"{path} must have logic samples, but has no member {capturefile} or {capturefile}-1")
        for number in range(1, len(chunks) + 1):
            if number not in chunks:
                raise CaptureError(
                    f"{len(chunks)} chunks of {path} must be {capturefile}-1 to {capturefile}-{len(chunks)}, "
                    f"but {capturefile}-{number} is missing"
                )
        members = [chunks[number] for number in sorted(chunks)]
    if (size := sum(info.file_size for info in members)) > _MOST_SAMPLES:
        raise CaptureError(f"samples of {path} must have at most {_MOST_SAMPLES} bytes, not {size}")
    for info in members:
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise CaptureError(f"{info.filename} of {path} must be stored or deflated, not method {info.compress_type}")
    return members


def parse_samplerate(path: Path, text: str | None) -> float | None:
    """Parse `24 MHz`, `12.5kHz`, `1000000`; 0 is what sigrok writes when it knows none."""
    if text is None or not text.strip():
        return None
    match = re.fullmatch(r"([0-9]+(?:\.[0-9]+)?)\s*([kmg]?)(?:hz)?", text.strip().lower())
    if not match:
        raise CaptureError(f"samplerate of {path} must be a number and Hz, kHz, MHz or GHz, not {text!r}")
    return float(Fraction(match[1]) * UNIT_HZ[match[2]]) or None


def agreed_samplerate(path: Path, in_file: float | None, given: float | None) -> float:
    """Return the samplerate of a file or the given one; CaptureError if they differ, or there is none."""
    if in_file is not None and given is not None and in_file != given:
        raise CaptureError(f"samplerate of {path} must be {in_file:.15g} Hz as the file has it, not {given:.15g} Hz")
    rate = in_file if in_file is not None else given
    if rate is None:
        raise CaptureError(f"{path} has no samplerate: give it with --samplerate")
    return rate


def _pieces(path: Path, archive: zipfile.ZipFile, session: _Session, piece: int) -> Iterator[NDArray[np.uint8]]:
    """Give the samples as arrays of shape (n, unitsize), about `piece` bytes at a time."""
    n_bytes = max(piece // session.unitsize, 1) * session.unitsize
    for info in session.members:
        with archive.open(info) as member:
            while data := member.read(n_bytes):
                if len(data) % session.unitsize:
                    raise CaptureError(
                        f"length of {info.filename} in {path} must be a multiple of unitsize {session.unitsize}, "
                        f"not {info.file_size} bytes"
                    )
                yield np.frombuffer(data, np.uint8).reshape(-1, session.unitsize)


def divide(k: NDArray[np.int64], rate: float, *, up: bool) -> NDArray[np.float64]:
    """Give k / rate as float64, rounded down or up, never to nearest.

    To nearest, one quotient in twelve lies so far above that `ceil(k / rate * rate)` is k + 1. Rounded down, the
    product with a multiple of the rate is at or below the integer that it should be, and rounding cannot pass that.
    """
    count = k.astype(np.float64)
    quotient = count / rate
    # Dekker's product: quotient * rate = product + rest, exactly; the sign of what differs from k tells the rounding.
    product = quotient * rate
    high, low = _halves(quotient)
    rate_high, rate_low = _halves(np.full(1, rate))
    rest = low * rate_low - (((product - high * rate_high) - low * rate_high) - high * rate_low)
    excess = (product - count) + rest
    wrong = excess < 0 if up else excess > 0
    return np.where(wrong, np.nextafter(quotient, np.inf if up else 0.0), quotient)


def _halves(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Split into two float64 of 26 bits each that add up to x, after Veltkamp."""
    scaled = x * 134217729.0  # 2^27 + 1
    high = scaled - (scaled - x)
    return high, x - high


def _channel(axis: int, name: str) -> str:
    """Return the channel of a line of one of many axes; all have the external tick together."""
    return name.upper() if name == "tick_in" else f"{name.upper()}{axis}"
