"""Frames in which registers are read and written over serial lines; docs/guides/serial.md has pictures of them.

SPI, most significant bits and bytes first. Chip select low begins a frame, and high ends it. Byte 0 has the write bit
and the address of a word. A read goes on with 5 bytes for each word: status, then the word; a write with 5 bytes for
each word too: the word, then its status, which may be left out at the end. The address counts on. Status is `MARK`, and
`ERROR` if there is no such register, or it cannot be written. A word that is not complete is not written.

UART, least significant bytes first, as the bits of a byte are. A request is a header with type and sequence, the
address of a word, then the number of words to be read in a byte, or the word to be written, and the check. The answer
is the header with `FROM_CORE` set, the words that were read, a byte of status, and the check. Telemetry, which the demo
sends unasked, is an answer to a read of all captured registers; its sequence counts on, also when a frame is left out.
The other types are free.
"""

import binascii
from dataclasses import dataclass
from enum import IntEnum

SPI_ADDRESS_WIDTH = 7
SPI_SCK_CYCLES = 8  # clocks of a period of sck, at least
MARK = 1 << 7  # tells status from lines that are stuck
ERROR = 1 << 0

SEQUENCES = 16
TYPE_LOW = 4  # lowest bit of the type in a header
FROM_CORE = 7  # bit of a header that is set in what the core sends
UART_ADDRESS_WIDTH = COUNT_WIDTH = 8
QUIET_BITS = 32  # bits of a quiet line after which a request can begin, whatever was before

# The check is CRC-16/MCRF4XX, as in MAVLink: polynomial and start of CCITT-FALSE, with bits in the order of the line.
CRC_WIDTH, CRC_POLYNOMIAL, CRC_START = 16, 0x1021, 0xFFFF
_CHECK_BYTES = CRC_WIDTH // 8
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))

_WORD_BYTES = 4


class Type(IntEnum):
    """Says which purpose a frame of the UART has."""

    READ = 0
    WRITE = 1
    TELEMETRY = 2


TELEMETRY_HEADER = 1 << FROM_CORE | Type.TELEMETRY << TYPE_LOW


class FrameError(ValueError):
    """No frame came, or not the one that was expected."""


@dataclass(frozen=True)
class Request:
    """Holds a request over the UART, as `decode_request` found it."""

    type: Type
    sequence: int  # repeated in the answer
    address: int  # of the first word
    value: int  # number of words to be read, or the word to be written


@dataclass(frozen=True)
class Answer:
    """Holds an answer."""

    words: tuple[int, ...]  # what was read; 0 where there is no register
    error: bool  # there is no register at one of the addresses, or it cannot be written


def crc(data: bytes) -> int:
    """Return the check of some bytes; over a frame with its check it is 0."""
    # That of the library has the same polynomial, but the bits the other way round.
    high, low = divmod(binascii.crc_hqx(data.translate(_REVERSED), CRC_START), 256)
    return _REVERSED[low] << 8 | _REVERSED[high]


def with_check(data: bytes) -> bytes:
    """Return bytes of a frame of the UART, with its check."""
    return data + crc(data).to_bytes(_CHECK_BYTES, "little")


def read_request(address: int, n_words: int = 1, sequence: int = 0) -> bytes:
    """Return a request over the UART for words that follow each other; ValueError if a number is out of range."""
    _check("n_words", n_words, 1 << COUNT_WIDTH)
    return with_check(_head(Type.READ, sequence, address) + bytes([n_words]))


def write_request(address: int, data: int, sequence: int = 0) -> bytes:
    """Return a request over the UART to write a word; ValueError if a number is out of range."""
    _check("data", data, 1 << 8 * _WORD_BYTES)
    return with_check(_head(Type.WRITE, sequence, address) + data.to_bytes(_WORD_BYTES, "little"))


def decode_request(frame: bytes) -> Request:
    """Return what a request over the UART asks for; FrameError if it is none, or damaged."""
    body = _checked(frame)
    if not body or body[0] >> TYPE_LOW not in (Type.READ, Type.WRITE):
        raise FrameError("a request must begin with its type")
    kind = Type(body[0] >> TYPE_LOW)
    if len(body) != 2 + (_WORD_BYTES if kind is Type.WRITE else 1):
        raise FrameError(f"a request must be as long as its type says, not {len(frame)} bytes")
    return Request(kind, body[0] % SEQUENCES, body[1], int.from_bytes(body[2:], "little"))


def answer_length(request: bytes) -> int:
    """Return bytes of the answer to a request; FrameError if the request is none."""
    asked = decode_request(request)
    return 2 + _CHECK_BYTES + (_WORD_BYTES * asked.value if asked.type is Type.READ else 0)


def decode_answer(request: bytes, frame: bytes) -> Answer:
    """Return what the core has answered to a request.

    It raises FrameError if it is no answer, damaged, or that to another request.
    """
    body = _checked(frame)
    length = answer_length(request)
    if len(frame) != length:
        raise FrameError(f"the answer must have {length} bytes, not {len(frame)}")
    if body[0] != request[0] | 1 << FROM_CORE:
        raise FrameError(f"the answer must be that to request {request[0]:#04x}, not begin with {body[0]:#04x}")
    if body[-1] not in (0, ERROR):
        raise FrameError(f"the status of an answer must be 0 or {ERROR}, not {body[-1]}")
    return Answer(_words(body[1:-1]), body[-1] == ERROR)


def telemetry_length(n_words: int) -> int:
    """Return bytes of a frame of telemetry with so many words."""
    return 2 + _CHECK_BYTES + _WORD_BYTES * n_words


def decode_telemetry(frame: bytes) -> tuple[int, tuple[int, ...]]:
    """Return sequence and words of a frame of telemetry; FrameError if it is none, or damaged."""
    body = _checked(frame)
    if len(body) % _WORD_BYTES != 2 or body[-1]:
        raise FrameError("telemetry must have whole words and status 0")
    if body[0] & ~(SEQUENCES - 1) != TELEMETRY_HEADER:
        raise FrameError(f"telemetry must begin with {TELEMETRY_HEADER:#04x} and its sequence, not {body[0]:#04x}")
    return body[0] % SEQUENCES, _words(body[1:-1])


def _check(what: str, value: int, end: int) -> None:
    if not 0 <= value < end:
        raise ValueError(f"{what} must be from 0 to {end - 1}, not {value}")


def _head(kind: Type, sequence: int, address: int) -> bytes:
    _check("sequence", sequence, SEQUENCES)
    _check("address", address, 1 << UART_ADDRESS_WIDTH)
    return bytes([kind << TYPE_LOW | sequence, address])


def _checked(frame: bytes) -> bytes:
    """Return a frame without its check."""
    if crc(frame):
        raise FrameError("the check of a frame must be right")
    return frame[:-_CHECK_BYTES]


def _words(data: bytes) -> tuple[int, ...]:
    parts = range(0, len(data), _WORD_BYTES)
    return tuple(int.from_bytes(data[part : part + _WORD_BYTES], "little") for part in parts)
