"""The serial unit of the tracking machine: one register that is added to, and goes to the right."""

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed

from tachometry.hdl.methods.track_unit import Unit
from tachometry.spec.formats.tracking import CHANCE_BITS, LOG_BITS, RESULT_BITS, WIDTH
from tachometry.spec.formats.tracking_code import BY_FACTOR, Program
from tachometry.spec.formats.tracking_units import Serial, Start


class SerialUnit(Unit):
    """One register that takes what is added at its top, and goes to the right by 2 or by 8 places; see `Serial`.

    A product takes two bits of the factor a clock, as a digit 0, 1, 2 or −1. All else is added once: as it is; twice if
    it goes to the right by an odd number of places; its bits inverted if its logarithm is meant and it is negative.
    """

    def __init__(self, program: Program) -> None:
        super().__init__(program)
        self._serial = serial = Serial(program.form)
        self.operand = Signal(signed(WIDTH), reset_less=True)
        self.with_sum = self.start
        self.work = Signal(signed(serial.low + WIDTH), reset_less=True)
        # One of these, or it rests.
        self.reads = Signal()
        self.adds = Signal()
        self.shifts = Signal()
        # The operation: `read` is a second one, which shifts what came from the table.
        self.is_log = Signal(reset_less=True)
        self.is_factor = Signal(reset_less=True)
        self.is_product = Signal(reset_less=True)
        self.is_power = Signal(reset_less=True)
        self.is_read = Signal(reset_less=True)
        self.doubled = Signal(name="is_doubled", reset_less=True)  # it goes by an odd number of places
        self.extreme = Signal(name="is_extreme", reset_less=True)  # a power that is 0, or too large
        # Digits of the factor, which turns meanwhile.
        self.steps = Signal(range(serial.digits + 1), reset_less=True)
        self.before = Signal()  # the bit below those of this digit
        self.owed = Signal()  # by the digit before
        self.multiplies = Signal()
        self.code = Signal(2)  # the digit that is added next, or all at once
        self.minus = Signal()
        # Shifts.
        self.pairs = Signal(signed(6), reset_less=True)  # of places that it went; below 0 those that it is still to go
        self.by_8 = Signal()
        self.by_2 = Signal()
        self.there = Signal()
        self.ends = Signal()
        self.large = Signal()  # the product is
        # One adder has the rounding, the pairs and the sum.
        self.addend = Signal(signed(WIDTH + 2))
        self.total = Signal(signed(WIDTH + 2))
        self.both = Signal(CHANCE_BITS + 8 + len(self.total))

    @property
    def factor_bits(self) -> int:
        return 2 * Serial(self._program.form).digits

    @property
    def _starts(self) -> Value:
        return (self.start != Start.NONE) & (self.start != Start.CHANCE)

    @property
    def _begins(self) -> Value:
        return (self.doing != Start.NONE) & (self.doing != Start.CHANCE)

    @property
    def _rests(self) -> Value:
        return ~(self.reads | self.adds | self.shifts)

    @property
    def _seeks(self) -> Value:
        return self.is_log | self.is_factor

    def _work(self, m: Module) -> None:
        self._add(m)
        self._shift(m)
        self._count_pairs(m)
        self._begin(m)
        self._read(m)
        self._end(m)
        m.d.comb += [
            self.busy.eq(self._begins | ~self._rests),
            self.result.eq(self.work[CHANCE_BITS : CHANCE_BITS + WIDTH].as_signed()),
        ]
        self._look_up(m)
        m.d.sync += [
            self.reads.eq(self._begins | (self.ends & self.is_log)),
            self.adds.eq(self.reads | (self.adds & self.multiplies)),
            self.shifts.eq((self.adds & ~self.multiplies) | (self.shifts & ~self.ends)),
        ]

    def _add(self, m: Module) -> None:
        """Find what is added next: a digit of the factor, or all at once."""
        operand, owed, multiplies = self.operand, self.owed, self.multiplies
        digits = Mux(self.doubled, Cat(self.before, self.factor[0]), self.factor[:2])
        digit = Signal(3)  # 4 is a digit 0 that owes
        m.d.comb += [
            multiplies.eq(self.is_product & (self.reads | (self.adds & (self.steps != self._serial.digits)))),
            digit.eq(Cat(digits[0] ^ owed, digits[1] ^ (digits[0] & owed), digits.all() & owed)),
        ]
        nothing = self.extreme & operand[LOG_BITS + 8]
        once = Mux(self._seeks & ~self.is_read & operand[-1], 3, Mux(nothing, 0, 1 + self.doubled))
        m.d.sync += [
            self.code.eq(Mux(multiplies, digit[:2], once) & (self.reads | multiplies).replicate(2)),
            owed.eq(multiplies & (digit[2] | digit[:2].all())),
            self.minus.eq(multiplies & digit[:2].all()),
            self.before.eq(multiplies & self.factor[1]),
            self.steps.eq(Mux(multiplies, self.steps + 1, 0)),
        ]
        with m.Switch(self.code):
            with m.Case(0):
                pass
            with m.Case(1):
                m.d.comb += self.addend.eq(operand)
            with m.Case(2):
                m.d.comb += self.addend.eq(operand << 1)
            with m.Case(3):
                m.d.comb += self.addend.eq(~operand)

    def _shift(self, m: Module) -> None:
        """Add to the register, or let it go to the right, by 8 places while the leading one may be as far up."""
        work, pairs, by_8, by_2 = self.work, self.pairs, self.by_8, self.by_2
        to_go = Signal()
        # Whether the leading one is still so far up, known a clock before; of `far` only if the shift was by 8.
        far = Signal()
        near = Signal()
        was_there = Signal()  # a product is known to be too large a clock after it is there
        m.d.sync += [
            was_there.eq(self.there),
            self.large.eq(self.is_product & self.there & ~was_there & self.too_large(work)),
        ]
        m.d.sync += [
            far.eq(self._seeks & self._is_beyond(16)),
            near.eq(self._seeks & Mux(by_8, self._is_beyond(10), self._is_beyond(4))),
        ]
        m.d.comb += [
            to_go.eq(pairs[-1] & ~self.extreme),
            by_8.eq(self.shifts & ((to_go & ~(pairs[2:].all() & pairs[:2].any())) | far)),
            by_2.eq(self.shifts & ~by_8 & (to_go | near)),
            self.there.eq(self.shifts & ~by_8 & ~by_2),
            self.ends.eq(self.there & (was_there | ~self.is_product)),
        ]
        with m.If(self.adds | by_8 | by_2):
            m.d.sync += work.eq(Mux(by_8, work >> 8, Cat(work[2 : self._serial.low], self.total)))
        with m.If(self._begins | self.reads):
            m.d.sync += work.eq(0)
        with m.If(self.large):
            m.d.sync += work[CHANCE_BITS : CHANCE_BITS + RESULT_BITS].eq(0)
            m.d.sync += work[CHANCE_BITS + RESULT_BITS].eq(1)
            m.d.sync += work[CHANCE_BITS + RESULT_BITS + 1 : CHANCE_BITS + WIDTH].eq(work[-1].replicate(WIDTH))

    def _is_beyond(self, place: int) -> Value:
        """Return whether the leading one is further up than some places above the end of a logarithm or a factor."""
        work, end, bits = self.work, self._serial.log_end, self._bits
        return work[end + place :].any() | (self.is_factor & work[bits - 1 + place : end + place].any())

    def _count_pairs(self, m: Module) -> None:
        """Count the pairs of places to go: those of what is done, of the operand or factor, or of what was read.

        The adder also has the bits that decide how the result is rounded, as both ends of a carry chain take cells. The
        bit between, which is `up` twice, is their carry, and brings `up` to the pairs.
        """
        doing, serial, work, whole, minus = self.doing, self._serial, self.work, self.whole, self.minus
        more = Signal(signed(6), reset_less=True)
        up = Signal(reset_less=True)
        over_by = (doing == Start.OVER) & (self.how_done == BY_FACTOR)
        by_places = (doing == Start.TIMES) | over_by
        power = doing == Start.EXP
        again = self.reads & self.is_read & ~self.is_power
        way = (more | Cat(self.by_2, C(0, 1), self.by_8, C(0, 3)))[:6]
        m.d.comb += [
            self.both.eq(
                Cat(work[:CHANCE_BITS], up, self.pairs, minus, work[serial.low :], work[-1], work[-1])
                + Cat(self.chance, up, way, minus, self.addend)
            ),
            self.total.eq(self.both[CHANCE_BITS + 8 :]),
        ]
        m.d.sync += [
            more.eq(
                (Array(C(-serial.pairs(*kind), 6) for kind in self._shifts)[self.how] & self._starts.replicate(6))
                | (whole[1:7] & power.replicate(6))
                | ((self.places[1:] ^ over_by.replicate(6))[:6] & by_places.replicate(6))
                | (C(-serial.read_pairs, 6) & again.replicate(6))
            ),
            up.eq((whole[0] & power) | (over_by & ~self.places[0])),
            self.pairs.eq(self.both[CHANCE_BITS + 1 :][:6]),
        ]
        with m.If((self._rests & ~self._begins) | again):
            m.d.sync += self.pairs.eq(0)

    def _begin(self, m: Module) -> None:
        """Keep what begins."""
        doing, whole = self.doing, self.whole
        named_odd = Array(C(shift % 2, 1) for _, shift in self._shifts)[self.how_done]
        finds = (doing == Start.LOG) | (doing == Start.BY)
        too_small = whole[-1] & ~whole[4:-1].all()
        too_large = ~whole[-1] & (whole[6:-1].any() | (whole[5] & whole[2:5].any()))  # at least 2^36
        by_factor = Mux(self.how_done == BY_FACTOR, self.places[0], named_odd)
        odd = Mux(doing == Start.EXP, ~whole[0] & ~too_large, by_factor)
        odd &= ~finds & (doing != Start.GAIN)
        with m.If(self._begins):
            m.d.sync += [
                self.is_log.eq(doing == Start.LOG),
                self.is_factor.eq(doing == Start.BY),
                self.is_product.eq(doing == Start.TIMES),
                self.is_power.eq(doing == Start.EXP),
                self.is_read.eq((doing == Start.EXP) | (doing == Start.GAIN)),
                self.extreme.eq((doing == Start.EXP) & (too_small | (~whole[-1] & whole[6:-1].any()))),
                self.doubled.eq(odd),
            ]

    def _read(self, m: Module) -> None:
        """Take the operand, or what was read; above it is 0 where that is no logarithm, as a reset takes no cells."""
        places = Signal(6, reset_less=True)
        m.d.sync += places.eq(Cat(self.work[self._serial.log_end + 1], self.pairs[:5]))
        with m.If(~(self.ends & self.is_log)):
            m.d.sync += places.eq(0)
        with m.If(self._starts):
            m.d.sync += self.operand.eq(self.sum)
        with m.If(self.reads & self.is_read):
            read = self.table.data | (places << LOG_BITS)
            m.d.sync += [self.operand.eq(Cat(C(0, self._serial.table_place), read)), self.is_log.eq(0)]

    def _end(self, m: Module) -> None:
        """Round the result, or keep it as a factor, which turns while it multiplies."""
        work, bits = self.work, self._bits
        with m.If(self.ends):
            m.d.sync += [self.is_read.eq(1), self.up.eq(self.both[CHANCE_BITS] & ~self.large)]
        with m.If(self.ends & self.is_factor):
            m.d.sync += [
                self.factor.eq(Cat(work[0] & ~work[bits], work[1 : bits + 1])),
                self.places.eq(Cat(work[bits], self.pairs[:5])),
            ]
        with m.Elif(self.multiplies):
            m.d.sync += self.factor.eq(self.factor.rotate_right(2))

    def _look_up(self, m: Module) -> None:
        """Read the table at what begins, or at the logarithm that ends."""
        end = self._serial.log_end
        log = self.log_address(self.work[end - CHANCE_BITS :], self.work[end + 1])
        gain_or_log = Mux(self.doing == Start.GAIN, self.gain_address, log)
        m.d.comb += [
            self.table.en.eq(self._begins | self.ends),
            self.table.addr.eq(Mux(self.doing == Start.EXP, self.power_address, gain_or_log)),
        ]
