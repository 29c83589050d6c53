"""Programs read and write values of ports, whether they take one register or two."""

from collections.abc import Iterator
from dataclasses import dataclass

from tachometry.spec.language.field import WORD, Field, Register
from tachometry.spec.registers.map import RegisterMap


@dataclass(frozen=True)
class Value:
    """Describes what one register shows or takes, or two."""

    name: str  # of the port, or of what is written
    words: tuple[Register, ...]  # its registers, the lowest bits first

    @property
    def field(self) -> Field:
        """The field that has its lowest bits."""
        return self.words[0].fields[0]

    @property
    def bits(self) -> int:
        """Bits of all its registers."""
        return WORD * len(self.words)

    @property
    def c_type(self) -> str:
        """Its type in C."""
        return f"{'' if self.words[-1].fields[0].signed else 'u'}int{self.bits}_t"

    def joined(self, name: str) -> str:
        """Return the value in C, of what was read of its registers; functions begin with `name`."""
        words = [word.name.lower() for word in self.words]
        if self.field.signed:
            return f"{name}_signed_{self.bits}({', '.join(words)})"
        return words[0] if len(words) == 1 else f"(uint64_t){words[1]} << 32 | {words[0]}"


def captured_values(registers: RegisterMap) -> tuple[Value, ...]:
    """Return values that a capture takes, the first of them that whose first register captures."""
    found: dict[str, list[Register]] = {}
    for register in registers:
        for field in register.fields:
            if register.captured and field.port and field.width == WORD:
                found.setdefault(field.port, []).append(register)
    return tuple(Value(name, tuple(words)) for name, words in found.items())


def written_values(registers: RegisterMap) -> tuple[Value, ...]:
    """Return values that a program writes, less those of CONTROL and of the interrupt."""
    found: dict[str, list[Register]] = {}
    for register in registers:
        if register.writable and register.name != "CONTROL" and not register.name.startswith("INTERRUPT"):
            name = register.name.removesuffix("_LOW").removesuffix("_HIGH").lower()
            found.setdefault(name, []).append(register)
    return tuple(Value(name, tuple(words)) for name, words in found.items())


def is_whole(register: Register) -> bool:
    """Return whether a register has one field, of all of its bits; then the texts speak of the register alone."""
    return [field.width for field in register.fields] == [WORD]


def in_unit(field: Field) -> str:
    """Return a sentence about the unit of a field; an empty one if it has none."""
    if not field.unit:
        return ""
    return f"One LSB is {field.unit}." if field.unit[0].isdigit() else f"The unit is {field.unit}."


def sentences(register: Register) -> str:
    """Return what a register means, when it captures, its unit, and how it is read."""
    return " ".join(filter(None, _sentences(register)))


def _sentences(register: Register) -> Iterator[str]:
    yield register.help
    yield from dict.fromkeys(map(in_unit, register.fields))
    if is_whole(register):
        (field,) = register.fields
        if field.signed:
            yield "It is in two's complement."
        if field.most is not None:
            yield f"What is written is held within {field.least} and {field.most}."
        elif field.kept < WORD:
            yield f"It wraps: {field.kept} bits are kept."
    if register.captures:
        yield "Reading it captures, unless CONTROL.hold is set."
