"""A number held within bounds."""

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed


def saturate(m: Module, value: Signal, limit: int) -> tuple[Signal, Signal]:
    """Return `value` held within −limit … +limit, and a flag that is high where that changed it."""
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
    """Return as `saturate`, of `raised` − `raised_for(…)`, with half of the cells.

    All numbers within the bounds have the same upper bits, 0, so none of these is compared with a sign. A number that
    is held within its bounds keeps its sign.
    """
    place = limit.bit_length()
    lower, negative = raised[:place], ~raised[place]
    far = Signal()
    above = Signal()
    below = Signal()
    changed = Signal()
    sign = Signal()
    held = Signal(signed(place + 1))
    is_above, is_below = _exceeds(lower, limit, Const(0)), _exceeds(~lower, limit, Const(1))
    m.d.comb += [
        far.eq(raised[place + 1 :].any()),
        # For waveforms. Where `changed` takes these signals instead, or without them, Yosys finds a LUT more.
        above.eq(is_above),
        below.eq(is_below),
        changed.eq(Mux(negative, is_below | far, is_above | far)),
        sign.eq((far & raised[-1]) | (~far & negative)),
        held.eq(Cat(*(_bit_held(bit, changed, sign, limit, at) for at, bit in enumerate(lower)), sign)),
    ]
    return held, changed


def _bit_held(bit: Value, changed: Signal, sign: Signal, limit: int, place: int) -> Value:
    """Return a bit of the number, or of +`limit` or −`limit` if `changed`: most are equal, or need no Mux."""
    kept = ~changed & bit
    match limit >> place & 1, -limit >> place & 1:
        case 1, 1:
            return changed | bit
        case 1, 0:
            return (changed & ~sign) | kept
        case 0, 1:
            return (changed & sign) | kept
    return kept


def _beyond(value: Signal, limit: int) -> Value:
    """Return whether |value| is greater than `limit`."""
    negative = value[-1]
    # value ^ negative is |value|, or one less if it is negative; then equal is beyond, too.
    return _exceeds(value[:-1] ^ negative.replicate(len(value) - 1), limit, negative)


def _exceeds(size: Value, limit: int, equal: Value) -> Value:
    """Return whether size > limit, or `equal` if it is the same, by gates of few bits.

    A carry chain is slower up to a dozen bits.
    """
    exceeds = equal
    for place, bit in enumerate(size):
        exceeds = bit & exceeds if limit >> place & 1 else bit | exceeds
    return exceeds
