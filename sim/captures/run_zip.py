"""Zip files of long runs of equal bytes, byte for byte the same on every machine.

zlib promises what its output unpacks to, not which bytes it is: zlib, zlib-ng and their versions pack the same input
differently. Signals on a clock are runs of one level, so deflate (RFC 1951) is written here from the runs: one block
with the fixed codes, each run as its first byte and matches at distance 1. A long run takes 13 bits per 258 bytes.
"""

import struct
import zlib
from functools import cache
from types import TracebackType
from typing import BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

N_LEVELS = 16  # values of a byte that the code book below holds: four lines
LONGEST = 258  # longest match of deflate
STORED, DEFLATED = 0, 8
VERSION, DATE = 20, 0x0021  # PKZIP 2.0; 1980-01-01, the earliest that a zip can tell
SLICE = 1 << 18  # symbols expanded to bits at once


def _literal(value: int) -> str:
    return f"{0x30 + value:08b}"


def _match(length: int) -> str:
    """Give the bits, in order of sending, of a match of `length` (3 to 258) at distance 1."""
    excess = length - 3
    n_extra = max(excess.bit_length() - 3, 0)
    symbol, extra = 257 + 4 * n_extra + (excess >> n_extra), excess & ((1 << n_extra) - 1)
    if length == LONGEST:
        symbol, n_extra = 285, 0
    code = f"{symbol - 256:07b}" if symbol < 280 else f"{0xC0 + symbol - 280:08b}"
    # Huffman codes go out with the high bit first, extra bits with the low bit first; distance 1 is code 0 of 5 bits.
    return code + (f"{extra:0{n_extra}b}"[::-1] if n_extra else "") + "00000"


@cache
def _code_book() -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Give the bits, and which of them count, of "`n` more bytes of `value`" in row value * (LONGEST + 1) + n."""
    words = [
        _literal(value) * n if n < 3 else _match(n)  # a match has at least three bytes
        for value in range(N_LEVELS)
        for n in range(LONGEST + 1)
    ]
    width = max(map(len, words))
    bits = np.array([[int(bit) for bit in word.ljust(width, "0")] for word in words], np.uint8)
    return bits, np.arange(width) < np.array([len(word) for word in words])[:, None]


def deflate_runs(value: NDArray[np.uint8], length: NDArray[np.int64]) -> bytes:
    """Pack runs as a deflate stream.

    Parameters
    ----------
    value : uint8 array, shape (n,), below `N_LEVELS`
        Byte of each run.
    length : int64 array, shape (n,), at least 1
        Bytes in each run.
    """
    n_longest, rest = np.divmod(length - 1, LONGEST)
    row = value.astype(np.int64) * (LONGEST + 1)
    rows = np.stack([row + 1, row + LONGEST, row + rest], axis=1).ravel()
    counts = np.stack([np.ones_like(length), n_longest, np.minimum(rest, 1)], axis=1).ravel()
    symbols = np.repeat(rows, counts)
    bits, used = _code_book()
    packed = []
    pending = np.array([1, 1, 0], np.uint8)  # last block, fixed codes
    for start in range(0, len(symbols), SLICE):
        part = symbols[start : start + SLICE]
        pending = np.concatenate([pending, bits[part][used[part]]])
        whole = len(pending) // 8 * 8
        packed.append(np.packbits(pending[:whole], bitorder="little").tobytes())
        pending = pending[whole:]
    end_of_block = np.zeros(7, np.uint8)
    packed.append(np.packbits(np.concatenate([pending, end_of_block]), bitorder="little").tobytes())
    return b"".join(packed)


class RunZip:
    """A zip file, written from front to back, that holds texts and runs.

    Parameters
    ----------
    file : binary file
        Open for writing, at its beginning; it stays open.

    Raises
    ------
    ValueError
        If the file would need zip64: 4 GiB or 65535 members.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._offset = 0
        self._directory: list[bytes] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self._end()

    def add_text(self, name: str, text: str) -> None:
        """Add a member that is stored as it is."""
        data = text.encode()
        self._add(name, STORED, data, zlib.crc32(data), len(data))

    def add_runs(self, name: str, value: NDArray[np.uint8], length: NDArray[np.int64]) -> None:
        """Add a member that holds `length` times `value`, run after run; it is expanded once, for its checksum."""
        crc = zlib.crc32(np.repeat(value, length).data)
        self._add(name, DEFLATED, deflate_runs(value, length), crc, int(length.sum()))

    def _add(self, name: str, method: int, data: bytes, crc: int, size: int) -> None:
        name_bytes = name.encode("ascii")
        common = struct.pack("<5H3L2H", VERSION, 0, method, 0, DATE, crc, len(data), size, len(name_bytes), 0)
        local = b"PK\x03\x04" + common + name_bytes
        # made by system 0 with no attributes, whatever the machine
        entry = b"PK\x01\x02" + struct.pack("<H", VERSION) + common + struct.pack("<3H2L", 0, 0, 0, 0, self._offset)
        self._directory.append(entry + name_bytes)
        self._write(local)
        self._write(data)
        if self._offset >= 1 << 32 or len(self._directory) >= 0xFFFF:
            raise ValueError("a zip file must be below 4 GiB and 65535 members: write a shorter signal")

    def _write(self, data: bytes) -> None:
        self._file.write(data)
        self._offset += len(data)

    def _end(self) -> None:
        start, n_members = self._offset, len(self._directory)
        directory = b"".join(self._directory)
        self._write(directory)
        self._write(b"PK\x05\x06" + struct.pack("<4H2LH", 0, 0, n_members, n_members, len(directory), start, 0))
