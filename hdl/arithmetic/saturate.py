"""A number held within bounds."""

from amaranth import Module, Mux, Signal, Value, signed


def saturate(m: Module, value: Signal, limit: int) -> tuple[Signal, Signal]:
    """`value` held within −limit … +limit, and a flag that is high where that changed it."""
    held = Signal(signed(limit.bit_length() + 1))
    changed = Signal()
    if limit >> (len(value) - 1):  # no value is as large
        m.d.comb += held.eq(value)
        return held, changed
    m.d.comb += [
        changed.eq(_beyond(value, limit)),
        # Not by which bound it is: most bits of the bounds are 0, and a register needs only its reset for these.
        held.eq(Mux(changed, Mux(value[-1], -limit, limit), value)),
    ]
    return held, changed


def _beyond(value: Signal, limit: int) -> Value:
    """Whether |value| is greater than `limit`, by gates of few bits: a carry chain is slower up to a dozen bits."""
    negative = value[-1]
    # value ^ negative is |value|, or one less if it is negative; then equal is beyond, too.
    beyond: Value = negative
    for place, bit in enumerate(value[:-1]):
        differs = bit ^ negative
        beyond = differs & beyond if limit >> place & 1 else differs | beyond
    return beyond
