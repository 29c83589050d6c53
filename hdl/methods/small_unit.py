"""The small unit of the tracking machine: one register that is added to, and goes to the right."""

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed

from tachometry.hdl.methods.track_unit import Unit
from tachometry.spec.formats.tracking import CHANCE_BITS, LOG_BITS, RESULT_BITS, WIDTH
from tachometry.spec.formats.tracking_code import BY_FACTOR, Program
from tachometry.spec.formats.tracking_units import Small, Start


class SmallUnit(Unit):
    """One register that takes what is added at its top, and goes to the right by 2 or by 8 places; see `Small`.

    A product takes two bits of the factor a clock, as a digit 0, 1, 2 or −1. All else is added once: as it is; twice if
    it goes to the right by an odd number of places; its bits inverted if its logarithm is meant and it is negative.
    """

    def __init__(self, program: Program) -> None:
        super().__init__(program)
        self.operand = Signal(signed(WIDTH), reset_less=True)
        self.with_sum = self.start

    @property
    def factor_bits(self) -> int:
        return 2 * Small(self._program.form).digits

    def _work(self, m: Module) -> None:
        bits, doing, table, operand = self._bits, self.doing, self.table.data, self.operand
        small = Small(self._program.form)
        low, width, end = small.low, small.low + WIDTH, small.log_end
        reads, adds, shifts = (Signal(name=name) for name in ("reads", "adds", "shifts"))  # else it rests
        work = Signal(signed(width), reset_less=True)
        steps = Signal(range(small.digits + 1), reset_less=True)
        pairs = Signal(signed(6), reset_less=True)  # of places that it went; below 0 those that it is still to go
        names = ("log", "factor", "product", "power", "read", "doubled", "extreme")
        flags = (Signal(name=f"is_{name}", reset_less=True) for name in names)
        is_log, is_factor, is_product, is_power, is_read, doubled, extreme = flags
        seeks = is_log | is_factor
        begins = (doing != Start.NONE) & (doing != Start.CHANCE)
        rests = ~(reads | adds | shifts)
        # What is added next: a digit of the factor, which turns meanwhile, or all at once.
        before = Signal()
        owed = Signal()
        minus = Signal()
        multiplies = Signal()
        code = Signal(2)
        how = self.how_done
        named_odd = Array(C(shift % 2, 1) for _, shift in self.shifts)[how]
        finds = (doing == Start.LOG) | (doing == Start.BY)
        by_factor = how == BY_FACTOR
        whole = self.whole
        too_small = whole[-1] & ~whole[4:-1].all()
        too_large = ~whole[-1] & (whole[6:-1].any() | (whole[5] & whole[2:5].any()))  # at least 2^36
        odd = Mux(doing == Start.EXP, ~whole[0] & ~too_large, Mux(by_factor, self.places[0], named_odd))
        odd &= ~finds & (doing != Start.GAIN)
        digits = Mux(doubled, Cat(before, self.factor[0]), self.factor[:2])
        digit = Signal(3)  # 4 is a digit 0 that owes
        m.d.comb += [
            multiplies.eq(is_product & (reads | (adds & (steps != small.digits)))),
            digit.eq(Cat(digits[0] ^ owed, digits[1] ^ (digits[0] & owed), digits.all() & owed)),
        ]
        nothing = extreme & operand[LOG_BITS + 8]
        once = Mux(seeks & ~is_read & operand[-1], 3, Mux(nothing, 0, 1 + doubled))
        m.d.sync += [
            code.eq(Mux(multiplies, digit[:2], once) & (reads | multiplies).replicate(2)),
            owed.eq(multiplies & (digit[2] | digit[:2].all())),
            minus.eq(multiplies & digit[:2].all()),
            before.eq(multiplies & self.factor[1]),
            steps.eq(Mux(multiplies, steps + 1, 0)),
        ]
        addend = Signal(signed(WIDTH + 2))
        with m.Switch(code):
            with m.Case(0):
                pass
            with m.Case(1):
                m.d.comb += addend.eq(operand)
            with m.Case(2):
                m.d.comb += addend.eq(operand << 1)
            with m.Case(3):
                m.d.comb += addend.eq(~operand)
        total = Signal(signed(WIDTH + 2))
        # Where it goes.
        by_8, by_2, there, ends, to_go = (Signal(name=name) for name in ("by_8", "by_2", "there", "ends", "to_go"))
        # Whether the leading one is still so far up, known a clock before; of `far` only if the shift was by 8.
        far = Signal()
        near = Signal()

        def beyond(place: int) -> Value:
            return work[end + place :].any() | (is_factor & work[bits - 1 + place : end + place].any())

        # A product is known to be too large a clock after it is there.
        was_there = Signal()
        large = Signal()
        m.d.sync += [was_there.eq(there), large.eq(is_product & there & ~was_there & self.too_large(work))]
        m.d.sync += [far.eq(seeks & beyond(16)), near.eq(seeks & Mux(by_8, beyond(10), beyond(4)))]
        m.d.comb += [
            to_go.eq(pairs[-1] & ~extreme),
            by_8.eq(shifts & ((to_go & ~(pairs[2:].all() & pairs[:2].any())) | far)),
            by_2.eq(shifts & ~by_8 & (to_go | near)),
            there.eq(shifts & ~by_8 & ~by_2),
            ends.eq(there & (was_there | ~is_product)),
        ]
        with m.If(adds | by_8 | by_2):
            m.d.sync += work.eq(Mux(by_8, work >> 8, Cat(work[2:low], total)))
        with m.If(begins | reads):
            m.d.sync += work.eq(0)
        with m.If(large):
            m.d.sync += work[CHANCE_BITS : CHANCE_BITS + RESULT_BITS].eq(0)
            m.d.sync += work[CHANCE_BITS + RESULT_BITS].eq(1)
            m.d.sync += work[CHANCE_BITS + RESULT_BITS + 1 : CHANCE_BITS + WIDTH].eq(work[-1].replicate(WIDTH))
        # How many pairs of places it is to go: first those of what is done, known before it begins, then those that the
        # operand or the factor says, or of what was read.
        more = Signal(signed(6), reset_less=True)
        up = Signal(reset_less=True)
        starts = (self.start != Start.NONE) & (self.start != Start.CHANCE)
        over_by = (doing == Start.OVER) & by_factor
        by_places = (doing == Start.TIMES) | over_by
        power = doing == Start.EXP
        again = reads & is_read & ~is_power
        # The same adder has the bits that decide how the result is rounded, as both ends of a carry chain take cells.
        # The bit between, which is `up` twice, is their carry, and brings `up` to the pairs.
        both = Signal(CHANCE_BITS + 8 + len(total))
        way = (more | Cat(by_2, C(0, 1), by_8, C(0, 3)))[:6]
        m.d.comb += [
            both.eq(
                Cat(work[:CHANCE_BITS], up, pairs, minus, work[low:], work[-1], work[-1])
                + Cat(self.chance, up, way, minus, addend)
            ),
            total.eq(both[CHANCE_BITS + 8 :]),
        ]
        m.d.sync += [
            more.eq(
                (Array(C(-small.pairs(*kind), 6) for kind in self.shifts)[self.how] & starts.replicate(6))
                | (whole[1:7] & power.replicate(6))
                | ((self.places[1:] ^ over_by.replicate(6))[:6] & by_places.replicate(6))
                | (C(-small.read_pairs, 6) & again.replicate(6))
            ),
            up.eq((whole[0] & power) | (over_by & ~self.places[0])),
            pairs.eq(both[CHANCE_BITS + 1 :][:6]),
        ]
        with m.If((rests & ~begins) | again):
            m.d.sync += pairs.eq(0)
        with m.If(begins):
            m.d.sync += [
                is_log.eq(doing == Start.LOG),
                is_factor.eq(doing == Start.BY),
                is_product.eq(doing == Start.TIMES),
                is_power.eq(doing == Start.EXP),
                is_read.eq((doing == Start.EXP) | (doing == Start.GAIN)),
                extreme.eq((doing == Start.EXP) & (too_small | (~whole[-1] & whole[6:-1].any()))),
                doubled.eq(odd),
            ]
        # What is to be above what is read, as 0 where that is no logarithm: a reset takes no cells.
        places = Signal(6, reset_less=True)
        m.d.sync += places.eq(Cat(work[end + 1], pairs[:5]))
        with m.If(~(ends & is_log)):
            m.d.sync += places.eq(0)
        with m.If(starts):
            m.d.sync += operand.eq(self.sum)
        with m.If(reads & is_read):
            m.d.sync += [operand.eq(Cat(C(0, small.table_place), table | (places << LOG_BITS))), is_log.eq(0)]
        with m.If(ends):
            m.d.sync += [is_read.eq(1), self.up.eq(both[CHANCE_BITS] & ~large)]
        with m.If(ends & is_factor):
            m.d.sync += [
                self.factor.eq(Cat(work[0] & ~work[bits], work[1 : bits + 1])),
                self.places.eq(Cat(work[bits], pairs[:5])),
            ]
        with m.Elif(multiplies):
            m.d.sync += self.factor.eq(self.factor.rotate_right(2))
        m.d.comb += [
            self.busy.eq(begins | ~rests),
            self.result.eq(work[CHANCE_BITS : CHANCE_BITS + WIDTH].as_signed()),
            self.table.en.eq(begins | ends),
            self.table.addr.eq(
                Mux(
                    doing == Start.EXP,
                    self.power_address,
                    Mux(
                        doing == Start.GAIN,
                        self.gain_address,
                        self.log_address(work[end - CHANCE_BITS :], work[end + 1]),
                    ),
                )
            ),
        ]
        m.d.sync += [
            reads.eq(begins | (ends & is_log)),
            adds.eq(reads | (adds & multiplies)),
            shifts.eq((adds & ~multiplies) | (shifts & ~ends)),
        ]
