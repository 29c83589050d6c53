"""Products of words with factors, one after the other in one multiplier."""

from collections.abc import Sequence
from dataclasses import dataclass

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed

_Chosen = tuple[Value, Value, Value]  # a term, a factor and a base


@dataclass(frozen=True)
class Product:
    """term·factor / 2^p, rounded, and a base added; the last of several is term·factor + base, without the division."""

    term: Value
    factor: Value | int
    base: Value
    kept: Signal | None  # what takes it


@dataclass(frozen=True)
class Multiplier:
    """A multiplier for a row of products.

    Serial, it takes a clock for each bit of a factor and 3; of a block of the FPGA it takes 4 clocks.
    """

    width: int  # bits of a term
    bits: int  # p, and bits of a signed factor
    shown: int  # bits of a result
    block: bool

    @property
    def clocks(self) -> int:
        """Clocks of a product."""
        return 4 if self.block else self.bits + 3

    def take(self, m: Module, begin: Value, products: Sequence[Product]) -> tuple[Value, Value, Value]:
        """Take all products from `begin` on, or from the last one on if it is taken then.

        Return when they begin, when the last one is there, and that; terms are read in the clock after they begin.
        """
        number, clock, last = Signal(range(len(products))), Signal(range(self.clocks + 1)), Signal()
        waits, begins = Signal(), Signal()
        m.d.comb += [last.eq(clock == self.clocks), begins.eq((begin | waits) & ~clock.any())]
        m.d.sync += waits.eq((begin | waits) & clock.any())
        ends = Signal()
        m.d.comb += ends.eq(number == len(products) - 1)
        with m.If(begins):
            m.d.sync += [number.eq(0), clock.eq(1)]
        with m.Elif(clock.any()):
            m.d.sync += clock.eq(Mux(last, ~ends, clock + 1))
            with m.If(last):
                m.d.sync += number.eq(number + 1)
        columns = ([one.term for one in products], [one.factor for one in products], [one.base for one in products])
        chosen = tuple(Array(column)[number] for column in columns)
        result, whole = (self._in_block if self.block else self._serially)(m, clock, chosen, ends)
        for at, one in enumerate(products):
            if one.kept is not None:
                with m.If(last & (number == at)):
                    m.d.sync += one.kept.eq(result)
        return begins, last & ends, whole

    def _serially(self, m: Module, clock: Signal, chosen: _Chosen, ends: Value) -> tuple[Value, Value]:
        """Let the sum move down as the factor does, whose last bit is its sign; then add the base to it.

        The last product begins with its base.
        """
        term, factor, base = chosen
        held, left, signs, adds = Signal(signed(self.width)), Signal(signed(self.bits)), Signal(), Signal()
        sum_, high = Signal(signed(self.width + self.bits)), Signal(signed(self.width + 1))
        addend = Mux(left[0], held ^ signs.replicate(self.width), 0)
        m.d.comb += [
            signs.eq(clock == self.bits + 1),
            adds.eq(clock == self.bits + 2),
            high.eq(sum_[self.bits :].as_signed() + Mux(adds, Mux(ends, 0, base), addend) + (left[0] & signs)),
        ]
        moved = Mux(adds, Cat(sum_[: self.bits], high), Cat(sum_[1 : self.bits], high))
        m.d.sync += [sum_.eq(moved), left.eq(left >> 1)]
        with m.If(clock == 1):
            begun = Mux(ends, base, 1 << self.bits - 1)
            m.d.sync += [held.eq(term), left.eq(factor), sum_.eq(Cat(C(0, self.bits), begun))]
        return (sum_ >> self.bits)[: self.shown], sum_[: self.shown]

    def _in_block(self, m: Module, clock: Signal, chosen: _Chosen, ends: Value) -> tuple[Value, Value]:
        """Multiply between two registers."""
        term, factor, base = chosen
        held, left = Signal(signed(self.width)), Signal(signed(self.bits))
        product, result = Signal(signed(self.width + self.bits)), Signal(self.shown)
        whole = Mux(ends, product, (product + (1 << self.bits - 1)) >> self.bits)
        m.d.sync += [held.eq(term), left.eq(factor), product.eq(held * left), result.eq(whole + base)]
        return result, result
