"""A register is a word of fields."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

WORD = 32  # bits


@dataclass(frozen=True)
class Field:
    """Bits of a register."""

    name: str
    width: int  # bits
    low: int = 0  # the lowest of them
    help: str = ""
    writable: bool = False  # a write changes it; else a write has no effect on it
    single: bool = False  # writing 1 has an effect in that clock, and it reads 0
    reset: int = 0  # its value after reset; of a constant, its value
    signed: bool = False  # the register is in two's complement
    unit: str = ""  # what one LSB is
    port: str = ""  # the port that it shows, if it shows one. If it is writable, that which it sets.
    shift: int = 0  # the bit of the port that is its lowest
    # of a field of a whole register, so many are kept of what is written, and extended by sign or zeros; 0: all
    bits: int = 0
    # least and most: what is written is held within these
    least: int | None = None
    most: int | None = None

    @property
    def kept(self) -> int:
        """Bits that are kept."""
        return self.bits or self.width

    @property
    def mask(self) -> int:
        """Its bits within the register."""
        return ((1 << self.width) - 1) << self.low

    @property
    def access(self) -> str:
        """`ro`, `rw`, or `wo` of a bit that acts when 1 is written."""
        return "wo" if self.single else "rw" if self.writable else "ro"


@dataclass(frozen=True)
class Register:
    """Word of 32 bits."""

    name: str
    offset: int  # bytes
    help: str
    fields: tuple[Field, ...]  # bits of none of them read 0
    captured: bool = False  # it keeps what it shows until the next capture
    captures: bool = False  # reading it captures first, unless CONTROL.hold is set
    constant: bool = False  # it never changes

    @property
    def writable(self) -> bool:
        """Whether a write is no error."""
        return any(field.writable for field in self.fields)

    @property
    def reset(self) -> int:
        """The value that is read after reset, before any capture."""
        return sum((field.reset << field.low) & field.mask for field in self.fields)


Draft = tuple[str, str, tuple[Field, ...], dict[str, bool]]  # name, help, fields, and what is true of the register


def position_words(name: str, help: str, port: str, width: int, reset: int = 0) -> Iterable[Draft]:
    """Yield the register of a position that a program writes, or two if it is wider than a word."""
    for shift, end in ({0: ""} if width <= WORD else {0: "_LOW", WORD: "_HIGH"}).items():
        last = width <= shift + WORD
        field = Field(
            "value",
            WORD,
            help=help,
            writable=True,
            reset=reset >> shift if last else reset & (1 << WORD) - 1,
            signed=last,
            unit="counts",
            port=port,
            shift=shift,
            bits=width - shift if last else 0,
        )
        yield f"{name}{end}", ("Upper word. " if shift else "" if last else "Lower word. ") + help, (field,), {}
