"""A number held within bounds."""

from amaranth import Cat, Module, Mux, Signal, Value, signed


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


def raised_for(most: int, limit: int) -> int:
    """By how much a sum within −most … +most should be kept higher, so that `saturate_raised` can hold it.

    That is the least power of two above `limit`, or 0 where nothing saturates.
    """
    return 1 << limit.bit_length() if limit < most else 0


def saturate_raised(m: Module, raised: Signal, limit: int) -> tuple[Signal, Signal]:
    """As `saturate`, of `raised` − `raised_for(…)`, with half of the cells.

    All numbers within the bounds have the same upper bits, 0, so none of these is compared with a sign.
    """
    place = limit.bit_length()
    within = Signal(signed(place + 1))
    far = Signal()
    held = Signal(signed(place + 1))
    changed = Signal()
    m.d.comb += [
        within.eq(Cat(raised[:place], ~raised[place])),
        far.eq(raised[place + 1 :].any()),
        changed.eq(far | _beyond(within, limit)),
        held.eq(Mux(changed, Mux(raised[-1] | ~(far | raised[place]), -limit, limit), within)),
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
