"""Products of words with factors, one after the other in one multiplier."""

from collections.abc import Sequence

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed

from tachometry.spec.formats.angles import Factor, clocks_of_product

# A term, a factor, a base, and what takes the result, or None.
Product = tuple[Value, Value | int, Value, Signal | None]


def term_of(factor: Factor, value: Value) -> Value:
    """Return the term of a factor, with no more bits than it has."""
    return value.shift_left(factor.shift) if factor.shift >= 0 else value.shift_right(-factor.shift)


def take_products(
    m: Module, begin: Value, products: Sequence[Product], bits: int, result_bits: int, *, block: bool = False
) -> tuple[Value, Value, Value]:
    """Take products from `begin` on, in so many clocks each; return when the one that nothing takes is there, when the
    last one is, and the former.

    A product is term·factor / 2^bits, rounded, and its base added; the one that nothing takes is term·factor + base. A
    factor has so many bits, with its sign. Term and factor are read in the first clock. With `block` it is a multiplier
    of the FPGA.
    """
    number = Signal(range(len(products)))
    clock = Signal(range(bits + 4))
    done = Signal()
    ends = Signal()
    whole = Signal()
    last = clocks_of_product(bits, block=block)
    m.d.comb += [done.eq(clock == last), ends.eq(number == len(products) - 1)]
    wholes = [target is None for *_, target in products]
    m.d.comb += whole.eq(number == wholes.index(True) if any(wholes) else 0)
    m.d.sync += clock.eq(Mux(begin | (done & ~ends), 1, Mux(clock.any() & ~done, clock + 1, 0)))
    with m.If(begin | done):
        m.d.sync += number.eq(Mux(begin, 0, number + 1))
    term, factor, base = (Array([product[part] for product in products])[number] for part in range(3))
    width = max(len(term) for term, *_ in products)
    base_bits = max(len(base) for *_, base, _ in products)
    if block:
        found = result = _multiply(m, (term, factor, base), whole, (width, bits, max(result_bits, base_bits)))
    else:
        base = Mux(whole, base << 1, base)
        sum_ = _add_bits(m, clock, (term, factor, base), whole, (max(result_bits + 1, width, base_bits), bits))
        found, result = sum_ >> bits, sum_[1:]
    for place, (*_, target) in enumerate(products):
        if target is not None:
            with m.If(done & (number == place)):
                m.d.sync += target.eq(found)
    return done & whole, done & ends, result[:result_bits]


def _multiply(m: Module, product: tuple[Value, Value, Value], unshifted: Value, widths: tuple[int, int, int]) -> Value:
    """Return a product with its base, after three clocks."""
    (term, factor, base), (width, bits, result_bits) = product, widths
    held = Signal(signed(width))
    left = Signal(signed(bits))
    whole = Signal(signed(width + bits))
    later = Signal.like(base)
    sum_ = Signal(signed(max(width, result_bits)))
    rounds = ~unshifted & whole[bits - 1]
    m.d.sync += [held.eq(term), left.eq(factor), whole.eq(held * left), later.eq(base)]
    m.d.sync += sum_.eq(Mux(unshifted, whole, whole >> bits) + later + rounds)
    return sum_


def _add_bits(
    m: Module, clock: Value, product: tuple[Value, Value, Value], unshifted: Value, widths: tuple[int, int]
) -> Value:
    """Return a product, behind so many bits or one: a sum moves down as the factor does, whose last bit is its sign.

    The base is added as a bit more: one behind the factor, or one before it, where ones are left of the last factor.
    """
    (term, factor, base), (width, bits) = product, widths
    held = Signal(signed(width))
    left = Signal(bits, init=-1)
    signs = Signal()
    sum_ = Signal(signed(width + bits + 1))
    high = Signal(signed(width + 1))
    addend = Mux(left[0], held ^ signs.replicate(width), 0)
    begins = clock == 1 + unshifted
    m.d.comb += high.eq(sum_[bits + 1 :].as_signed() + addend + (left[0] & signs))
    m.d.sync += [
        signs.eq(clock == bits + unshifted),
        left.eq(Mux(begins, factor, Cat(left[1:], C(1, 1)))),
        sum_.eq(Mux(clock == 1, Mux(unshifted, 0, 1 << 2 * bits), Cat(sum_[1 : bits + 1], high))),
    ]
    with m.If(begins | (clock == Mux(unshifted, 1, bits + 1))):
        m.d.sync += held.eq(Mux(begins, term, base))
    return sum_
