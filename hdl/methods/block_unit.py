"""The block unit of the tracking machine: a multiplier in a block, and a barrel shifter."""

from collections.abc import Sequence

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed

from tachometry.hdl.methods.track_unit import Unit
from tachometry.spec.formats.tracking import CHANCE_BITS, DROPPED, LOG_BITS, POWER_BITS, RESULT_BITS, TABLE_BITS, WIDTH
from tachometry.spec.formats.tracking_code import BY_FACTOR, Program
from tachometry.spec.formats.tracking_units import Start

_LOW = CHANCE_BITS - DROPPED  # zeros below a product


class BlockUnit(Unit):
    """A multiplier for half a word, and a barrel shifter in two stages; `tracking_units.BLOCK` has their times.

    An operation begins in any clock while others are under way, and its result stays until the next one comes. The
    program sees to it that no two want the same stage in one clock, see `tracking_order.clash`.
    """

    def __init__(self, program: Program) -> None:
        super().__init__(program)
        bits = self._bits
        # Of the doing before, and of that before it.
        self.last = Signal(Start)
        self.last_but_one = Signal(Start)
        self.begins = Signal()  # a product
        self.multiplied = Signal()
        self.ready = Signal()  # a product or a power
        # A product, of the lower half of the word and then of the upper; or a power: its last bit is that of 2^36.
        self.product = Signal(signed(WIDTH + bits), reset_less=True)
        self.distance = Signal(6, reset_less=True)  # that it goes
        # Of the doing: it seeks the leading one, that of a factor or of a logarithm; by how much it shifts by name.
        self.seeks = Signal()
        self.of_factor = Signal()
        self.of_log = Signal()
        self.named = Signal(6, reset_less=True)
        # Between both stages of the shifter.
        self.second = Signal(signed(WIDTH + bits + _LOW), reset_less=True)
        self.rest = Signal(6, reset_less=True)
        self.second_finds = Signal()
        self.second_factor = Signal()
        self.second_log = Signal(name="is_log")
        self.ends = Signal()
        self.large = Signal()  # a product is beyond ±2^36
        # Behind it.
        self.log_whole = Signal(6)
        self.was_log = Signal()
        self.was_gain = Signal()

    def _work(self, m: Module) -> None:
        by_power, by_product, by_shift = self._distances(m)
        m.d.sync += [self.last.eq(self.doing), self.last_but_one.eq(self.last)]
        self._multiply(m)
        with m.If(self.begins | (self.doing == Start.EXP)):
            m.d.sync += self.distance.eq(Mux(self.doing == Start.EXP, by_power, by_product))
        self._shift_far(m, by_shift)
        shifted = self._shift_near(m)
        self._end(m, shifted)

    def _distances(self, m: Module) -> tuple[Value, Value, Value]:
        """Return how far powers, products, and all others go to the right."""
        named, start = self.named, self.start
        places = Signal(signed(11))
        shifts = Array(C(shift, 6) for _, shift in self._shifts)
        m.d.sync += [
            named.eq(shifts[self.how]),
            self.seeks.eq((start == Start.LOG) | (start == Start.BY)),
            self.of_factor.eq(start == Start.BY),
            self.of_log.eq(start == Start.LOG),
        ]
        m.d.comb += places.eq(RESULT_BITS - self.whole)
        nothing = places[6:-1].any() & ~places[-1]
        by_power = Mux(places[-1] | ~places.any(), 1, places[:6] | nothing.replicate(6))
        by_product = (named + _LOW - self.places)[:6]
        return by_power, by_product, Mux(self.how_done == BY_FACTOR, self.places, named)

    def _multiply(self, m: Module) -> None:
        """Multiply the lower half of the word, and then the upper."""
        half = WIDTH // 2
        operand = Signal(signed(half + 1), reset_less=True)
        part = Signal(signed(half + 1 + self._bits), reset_less=True)
        low = Signal(half, reset_less=True)
        carried = Signal(self._bits, reset_less=True)
        begins, last, earlier = self.begins, self.last, self.last_but_one
        power = Cat(C(0, CHANCE_BITS + RESULT_BITS - POWER_BITS - _LOW), self.table.data[:POWER_BITS], C(1, 1))
        m.d.sync += [
            begins.eq(self.start == Start.TIMES),
            operand.eq(Mux(begins, self.sum[half:].as_signed(), self.coming)),
            part.eq(operand * self.factor),
            Cat(low, carried).eq(Mux(last == Start.TIMES, part, 0)),
            self.product.eq(Mux(last == Start.EXP, power, Cat(low, part + carried).as_signed())),
            self.multiplied.eq(earlier == Start.TIMES),
            self.ready.eq((earlier == Start.TIMES) | (last == Start.EXP)),
        ]

    def _shift_far(self, m: Module, by_shift: Value) -> None:
        """Shift by 32, 16 and 8 places."""
        finds, factor = self.seeks, self.of_factor
        size = (self.sum ^ (self.of_log & self.sum[-1]).replicate(WIDTH))[:WIDTH]
        value = Signal.like(self.second, reset_less=False)
        places = Signal(6)
        begin = self._bits - 1 - CHANCE_BITS  # from here on a factor is too large
        groups = [
            Mux(factor, size[begin + place : begin + place + 8].any(), size[place : place + 8].any())
            for place in range(8, WIDTH, 8)
        ]
        found = Mux(finds, Cat(C(0, 3), self.highest([C(0, 1), *groups])), by_shift)
        m.d.comb += [
            value.eq(
                Mux(self.ready, Cat(C(0, _LOW), self.product).as_signed(), Cat(C(0, CHANCE_BITS), size).as_signed())
            ),
            places.eq(Mux(self.ready, self.distance, found)),
        ]
        above = self.product[CHANCE_BITS + RESULT_BITS - _LOW :]
        beyond = (above ^ self.product[-1].replicate(len(above))) >> self.distance
        m.d.sync += [
            self.second.eq(self.shifted(m, value, places, (5, 4, 3))),
            self.rest.eq(places),
            self.second_finds.eq(finds),
            self.second_factor.eq(factor),
            self.second_log.eq(self.of_log),
            self.ends.eq(self.ready | (self.doing == Start.OVER)),
            self.large.eq(self.multiplied & beyond.any()),
        ]

    def _shift_near(self, m: Module) -> Value:
        """Shift by 4, 2 and 1 places, and read the table; return what was shifted."""
        ranges = (self.second[place : place + 8] for place in (self._bits - 1, CHANCE_BITS))
        places = Mux(self.second_finds, self.highest([*Mux(self.second_factor, *ranges)]), self.rest[:3])
        shifted = self.shifted(m, self.second, places, (0, 1, 2))
        whole = Cat(places[:3], self.rest[3:])
        with m.If(self.second_factor):
            m.d.sync += [self.factor.eq(shifted), self.places.eq(whole)]
        m.d.sync += [
            self.log_whole.eq(whole),
            self.was_log.eq(self.second_log),
            self.was_gain.eq(self.doing == Start.GAIN),
        ]
        gain_or_power = Mux(self.doing == Start.GAIN, self.gain_address, self.power_address)
        m.d.comb += self.table.addr.eq(Mux(self.second_log, self.log_address(shifted, C(0, 1)), gain_or_power))
        return shifted

    def _end(self, m: Module, shifted: Value) -> None:
        """Show what was shifted or looked up, held within 2^36 if it is a product."""
        found, data = shifted[CHANCE_BITS : CHANCE_BITS + WIDTH], self.table.data
        looked_up = Signal()
        m.d.comb += looked_up.eq(self.was_log | self.was_gain)
        read = Cat(data[:LOG_BITS], Mux(self.was_log, self.log_whole, data[LOG_BITS:]))
        low = Mux(looked_up, read, found[:TABLE_BITS])
        with m.If(self.ends | looked_up):
            m.d.sync += [
                self.result.eq(Cat(low, found[TABLE_BITS:]).as_signed()),
                self.up.eq((shifted[:CHANCE_BITS] + self.chance)[-1] & ~looked_up),
            ]
        with m.If(looked_up):
            m.d.sync += self.result[TABLE_BITS:].eq(0)
        with m.If(self.large):
            m.d.sync += [
                self.result[:RESULT_BITS].eq(0),
                self.result[RESULT_BITS].eq(1),
                self.result[RESULT_BITS + 1 :].eq(self.second[-1].replicate(WIDTH - RESULT_BITS - 1)),
                self.up.eq(0),
            ]

    @staticmethod
    def highest(flags: Sequence[Value]) -> Value:
        """Return the index of the last flag that is set, among at most eight; 0 if none is."""
        flags = [*flags, *[C(0, 1)] * (8 - len(flags))]
        far = Cat(flags[4:]).any()
        middle = Mux(far, flags[6] | flags[7], ~far & (flags[2] | flags[3]))
        near = flags[7] | (~flags[6] & (flags[5] | (~flags[4] & (flags[3] | (~flags[2] & flags[1])))))
        return Cat(near, middle, far)

    @staticmethod
    def shifted(m: Module, value: Value, places: Value, of: tuple[int, ...]) -> Value:
        """Return a value shifted by some powers of two."""
        for place in of:
            following = Signal(signed(len(value)), name=f"by_{1 << place}")
            m.d.comb += following.eq(Mux(places[place], value >> (1 << place), value))
            value = following
        return value
