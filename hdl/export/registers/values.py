"""What programs read of the captured registers: a value for every port, whether it takes one register or two."""

from collections.abc import Iterator
from dataclasses import dataclass

from tachometry.spec.registers.map import WORD, Field, Register, RegisterMap


@dataclass(frozen=True)
class CapturedValue:
    """A port of several bits, as its registers show it.

    Parameters
    ----------
    name : str
        Of the port.
    words : tuple of Register
        Its registers, the lowest bits first.
    """

    name: str
    words: tuple[Register, ...]

    @property
    def field(self) -> Field:
        """The field that has its lowest bits."""
        return self.words[0].fields[0]

    @property
    def bits(self) -> int:
        """Bits of all its registers."""
        return WORD * len(self.words)


def captured_values(registers: RegisterMap) -> tuple[CapturedValue, ...]:
    """Values that a capture takes, the first of them that whose first register captures."""
    found: dict[str, list[Register]] = {}
    for register in registers:
        for field in register.fields:
            if register.captured and field.port and field.width == WORD:
                found.setdefault(field.port, []).append(register)
    return tuple(CapturedValue(name, tuple(words)) for name, words in found.items())


def captured_flags(registers: RegisterMap) -> tuple[Field, ...]:
    """Flags that a capture takes."""
    return registers["STATUS"].fields


def is_whole(register: Register) -> bool:
    """Whether a register has one field, of all of its bits; then the texts speak of the register alone."""
    return [field.width for field in register.fields] == [WORD]


def in_unit(field: Field) -> Iterator[str]:
    """A sentence about the unit of a field that has one."""
    if field.unit:
        yield f"One LSB is {field.unit}." if field.unit[0].isdigit() else f"The unit is {field.unit}."


def sentences(register: Register) -> str:
    """What a register means, when it captures, its unit, and how it is read."""
    return " ".join(_sentences(register))


def _sentences(register: Register) -> Iterator[str]:
    yield register.help
    if is_whole(register):
        (field,) = register.fields
        yield from in_unit(field)
        if field.signed:
            yield "It is in two's complement."
        if field.most is not None:
            yield f"What is written is held within {field.least} and {field.most}."
        elif field.kept < WORD:
            yield f"It wraps: {field.kept} bits are kept."
    if register.captures:
        yield "Reading it captures, unless CONTROL.hold is set."
