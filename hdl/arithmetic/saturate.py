"""A number held within bounds."""

from amaranth import Const, Module, Mux, Signal, signed


def saturate(m: Module, value: Signal, limit: int) -> tuple[Signal, Signal]:
    """`value` held within −limit … +limit, and a flag that is high where that changed it."""
    held = Signal(signed(limit.bit_length() + 1))
    changed = Signal()
    if limit >> (len(value) - 1):  # no value is as large
        m.d.comb += held.eq(value)
        return held, changed
    above = Signal()
    below = Signal()
    m.d.comb += [
        above.eq(value > Const(limit, value.shape())),
        below.eq(value < Const(-limit, value.shape())),
        changed.eq(above | below),
        # Not by `above` and `below`: most bits of the bounds are 0, and a register needs only its reset for these.
        held.eq(Mux(changed, Mux(value[-1], -limit, limit), value)),
    ]
    return held, changed
