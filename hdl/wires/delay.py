"""Values of some clocks ago."""

from collections.abc import Mapping, Sequence

from amaranth import Module, Mux, Signal, Value, ValueLike


def delay(m: Module, *values: ValueLike, clocks: int = 1, only_if: Value | None = None) -> Sequence[Signal]:
    """Return registers that follow the values so many clocks later; where `only_if` is low, they become 0 instead.

    A register is named after what it follows, if that is a signal.
    """
    for _ in range(clocks):
        registers = []
        for value in values:
            followed = Value.cast(value)
            name = followed.name.removesuffix("_late") if isinstance(followed, Signal) else "value"
            register = Signal.like(value, name=f"{name}_late")
            m.d.sync += register.eq(value)
            if only_if is not None:  # the reset of a flip-flop is free, where a gate is not
                with m.If(~only_if):
                    m.d.sync += register.eq(0)
            registers.append(register)
        values = tuple(registers)
    return values


def held_with(m: Module, strobe: Value, values: Mapping[str, Value], clear: Value | None = None) -> dict[str, Value]:
    """Return values by their names as they are with a strobe, from its clock to the next one; 0 after `clear`."""
    held: dict[str, Value] = {}
    for name, value in values.items():
        kept = Signal.like(value, name=f"kept_{name}")
        held[name] = Mux(strobe, value, kept)
        m.d.sync += kept.eq(held[name])
        if clear is not None:
            with m.If(clear):
                m.d.sync += kept.eq(0)
    return held
