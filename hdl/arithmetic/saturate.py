"""A number held within bounds."""

from amaranth import Const, Module, Mux, Signal, Value, signed


def saturate(m: Module, value: Signal, limit: int) -> tuple[Signal, Signal]:
    """`value` held within −limit … +limit, and a flag that is high where that changed it."""
    held = Signal(signed(limit.bit_length() + 1))
    changed = Signal()
    if limit >> (len(value) - 1):  # no value is as large
        m.d.comb += held.eq(value)
        return held, changed
    m.d.comb += [
        changed.eq(_beyond(m, value, limit)),
        # Not by which bound it is: most bits of the bounds are 0, and a register needs only its reset for these.
        held.eq(Mux(changed, Mux(value[-1], -limit, limit), value)),
    ]
    return held, changed


def _beyond(m: Module, value: Signal, limit: int) -> Value:
    """Whether |value| is greater than `limit`."""
    low, high = value[: limit.bit_length()], value[limit.bit_length() :]
    if limit & (limit + 1) == 0:
        # The upper bits tell it, without a carry: all are the sign; and −limit − 1 is the one value that is left.
        return ~((high == 0) | (high.all() & low.any()))
    above = Signal()
    below = Signal()
    m.d.comb += [above.eq(value > Const(limit, value.shape())), below.eq(value < Const(-limit, value.shape()))]
    return above | below
