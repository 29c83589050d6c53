"""A register is a word of fields."""

from __future__ import annotations

from dataclasses import dataclass

WORD = 32  # bits


@dataclass(frozen=True)
class Field:
    """Describes some bits of a register.

    Parameters
    ----------
    width : int
        Bits.
    low : int
        The lowest of them.
    writable : bool
        A write changes it; else a write has no effect on it.
    single : bool
        Writing 1 has an effect in that clock, and it reads 0.
    reset : int
        Its value after reset; of a constant, its value.
    signed : bool
        The register is in two's complement.
    unit : str
        What one LSB is.
    port : str
        The port that it shows, if it shows one. If it is writable, that which it sets.
    shift : int
        The bit of the port that is its lowest.
    bits : int
        Of a field of a whole register, so many are kept of what is written, and extended by sign or zeros; 0: all.
    least, most : int or None
        What is written is held within these.
    """

    name: str
    width: int
    low: int = 0
    help: str = ""
    writable: bool = False
    single: bool = False
    reset: int = 0
    signed: bool = False
    unit: str = ""
    port: str = ""
    shift: int = 0
    bits: int = 0
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
    """Describes a word of 32 bits.

    Parameters
    ----------
    offset : int
        Bytes.
    fields : tuple of Field
        Bits of none of them read 0.
    captured : bool
        It keeps what it shows until the next capture.
    captures : bool
        Reading it captures first, unless CONTROL.hold is set.
    constant : bool
        It never changes.
    """

    name: str
    offset: int
    help: str
    fields: tuple[Field, ...]
    captured: bool = False
    captures: bool = False
    constant: bool = False

    @property
    def writable(self) -> bool:
        """Whether a write is no error."""
        return any(field.writable for field in self.fields)

    @property
    def reset(self) -> int:
        """The value that is read after reset, before any capture."""
        return sum((field.reset << field.low) & field.mask for field in self.fields)


Draft = tuple[str, str, tuple[Field, ...], dict[str, bool]]  # name, help, fields, and what is true of the register
