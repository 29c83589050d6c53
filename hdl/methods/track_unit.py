"""The unit of the tracking machine: products, logarithms, powers and shifts; one that is quick, and one that is small.

Both shift to the right alone. What is shifted has 8 bits below the LSB of the result, which decide how it is rounded. A
logarithm has the places until the leading one is at bit 8, and a table of what is behind; a power is of a table.
"""

from collections.abc import Sequence

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.spec.formats.tracking import (
    CHANCE_BITS,
    DROPPED,
    EXP_INDEX,
    GAIN_STEPS,
    GAINS,
    GAINS_FROM,
    LOG_BITS,
    LOG_INDEX,
    POWER_BITS,
    POWERS,
    RESULT_BITS,
    TABLE_BITS,
    WIDTH,
)
from tachometry.spec.formats.tracking_code import BY_FACTOR, HOW_BITS, Program
from tachometry.spec.formats.tracking_units import Start

_LOW = CHANCE_BITS - DROPPED  # zeros below a product
_GAIN_LOW = LOG_BITS - (GAIN_STEPS - 1).bit_length()


class Unit(wiring.Component):
    """Holds what both units share.

    Parameters
    ----------
    program : Program

    Members
    -------
    begin : In(1)
        A tick begins: results are rounded to the nearest until the event has a number.
    start : In(Start)
        What begins. While the unit is busy nothing does.
    how : In
        Number of the shift, or of the table of gains.
    sum : In(signed)
        The operand: of the quick unit a clock later.
    busy : Out(1)
        The result is not there yet.
    result : Out(signed)
    up : Out(1)
        It is to be rounded up, by one.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._bits = program.form.factor_bits
        self.factor = Signal(self.factor_bits, reset_less=True)
        self.places = Signal(6, reset_less=True)
        self.doing = Signal(Start)
        super().__init__(
            {
                "begin": In(1),
                "start": In(Start),
                "how": In(HOW_BITS),
                "sum": In(signed(WIDTH)),
                "busy": Out(1),
                "result": Out(signed(WIDTH)),
                "up": Out(1),
            }
        )
        self.operand, self.with_sum = self.sum, self.doing  # in the clock after the start; what begins with the sum

    def elaborate(self, platform: object) -> Module:
        m = Module()
        self.how_done = Signal(HOW_BITS)
        m.d.sync += [self.doing.eq(self.start), self.how_done.eq(self.how)]
        # The number of the event, its bits reversed.
        self.chance = Signal(CHANCE_BITS)
        with m.If(self.begin):
            m.d.sync += self.chance.eq(1 << CHANCE_BITS - 1)
        with m.Elif(self.with_sum == Start.CHANCE):
            m.d.sync += self.chance.eq(Cat(reversed(self.sum[:CHANCE_BITS])))
        values = self._program.tables
        m.submodules.tables = tables = Memory(shape=TABLE_BITS, depth=1 << (len(values) - 1).bit_length(), init=values)
        self.table = tables.read_port()
        # The place in a table of gains: 16 an octave, from X = 1/4 on.
        place = (~self.operand)[_GAIN_LOW : _GAIN_LOW + 9]
        beyond = place[8] | (place[7] & place[5:7].any())  # beyond the last
        gain = Mux(beyond, GAINS_FROM - 1, place[: GAINS.bit_length() - 1])
        self.gain_address = Cat(gain, (self.how_done[:2] + len(POWERS) // GAINS)[:3])
        self.power_address = self.operand[LOG_BITS - EXP_INDEX : LOG_BITS]
        self.whole = self.operand[LOG_BITS : LOG_BITS + 9].as_signed()
        shifts = self._program.shifts
        self.shifts = (*shifts, *[(Start.OVER, 0)] * ((1 << HOW_BITS) - len(shifts)))
        self._work(m)
        return m

    @property
    def factor_bits(self) -> int:
        """Bits that the factor is kept in."""
        return self._bits

    def _work(self, m: Module) -> None:
        raise NotImplementedError

    @staticmethod
    def log_address(shifted: Value, above: Value) -> Value:
        """Return where the logarithm stands of what is behind the leading one at bit 8, or at bit 9 if `above`."""
        return Cat(shifted[CHANCE_BITS - LOG_INDEX : CHANCE_BITS], shifted[CHANCE_BITS] | ~above, above, C(1, 1))

    @staticmethod
    def too_large(product: Value) -> Value:
        """Tell whether a product is beyond ±2^36."""
        most = product[CHANCE_BITS + RESULT_BITS :]
        return most != product[-1].replicate(len(most))


class QuickUnit(Unit):
    """A multiplier for half a word, and a barrel shifter in two stages; `tracking_units.QUICK` has their times.

    A factor may begin while another operation is under way, but not two clocks after a product or a power, which is
    shifted when it would be. It is used two clocks after its begin, or later. The program sees to both.
    """

    def _work(self, m: Module) -> None:
        bits, doing, how = self._bits, self.doing, self.how_done
        width = WIDTH + bits + _LOW
        # How far powers, products, and all others, go to the right.
        named = Signal(6)
        places = Signal(signed(11))
        m.d.comb += [named.eq(Array(C(shift, 6) for _, shift in self.shifts)[how]), places.eq(RESULT_BITS - self.whole)]
        nothing = places[6:-1].any() & ~places[-1]
        by_power = Mux(places[-1] | ~places.any(), 1, places[:6] | nothing.replicate(6))
        by_product = (named + _LOW - self.places)[:6]
        by_shift = Mux(how == BY_FACTOR, self.places, named)
        size = (self.sum ^ ((doing == Start.LOG) & self.sum[-1]).replicate(WIDTH))[:WIDTH]
        left = Signal(3)
        last = Signal(Start)
        latencies = Array(C(max(getattr(self._program.times, item.name.lower(), 1) - 1, 0), 3) for item in Start)
        m.d.comb += self.busy.eq(left.any())
        m.d.sync += [left.eq(Mux(left.any(), left - 1, latencies[self.start])), last.eq(doing)]
        # A product, of the lower half of the word and then of the upper; or a power: its last bit is that of 2^36.
        half = WIDTH // 2
        product = Signal(signed(WIDTH + bits), reset_less=True)
        distance = Signal(6, reset_less=True)
        low = Signal(half, reset_less=True)
        carried = Signal(bits, reset_less=True)
        upper = Signal(signed(half), reset_less=True)
        begins = Signal()
        part = Mux(begins, self.sum[:half], upper) * self.factor
        ready = Signal()
        multiplied = Signal()
        power = Cat(C(0, CHANCE_BITS + RESULT_BITS - POWER_BITS - _LOW), self.table.data[:POWER_BITS], C(1, 1))
        m.d.sync += [
            begins.eq(self.start == Start.TIMES),
            Cat(low, carried).eq(Mux(begins, part, 0)),
            upper.eq(self.sum[half:]),
            product.eq(Mux(last == Start.EXP, power, Cat(low, part + carried).as_signed())),
            multiplied.eq(last == Start.TIMES),
            ready.eq((last == Start.TIMES) | (last == Start.EXP)),
        ]
        with m.If(begins | (doing == Start.EXP)):
            m.d.sync += distance.eq(Mux(doing == Start.EXP, by_power, by_product))
        # First stage: by 32, 16 and 8.
        finds, factor = (doing == Start.LOG) | (doing == Start.BY), doing == Start.BY
        value = Signal(signed(width))
        places = Signal(6)
        begin = bits - 1 - CHANCE_BITS  # from here on a factor is too large
        groups = [
            Mux(factor, size[begin + place : begin + place + 8].any(), size[place : place + 8].any())
            for place in range(8, WIDTH, 8)
        ]
        m.d.comb += [
            value.eq(Mux(ready, Cat(C(0, _LOW), product).as_signed(), Cat(C(0, CHANCE_BITS), size).as_signed())),
            places.eq(Mux(ready, distance, Mux(finds, Cat(C(0, 3), self.highest([C(0, 1), *groups])), by_shift))),
        ]
        second = Signal(signed(width), reset_less=True)
        # Second stage: by 4, 2 and 1.
        rest = Signal(6, reset_less=True)
        second_finds = Signal()
        second_factor = Signal()
        ends = Signal()
        is_log = Signal()
        may_be_large = Signal()
        m.d.sync += [
            second.eq(self.shifted(m, value, places, (5, 4, 3))),
            rest.eq(places),
            second_finds.eq(finds),
            second_factor.eq(factor),
            is_log.eq(doing == Start.LOG),
            ends.eq(ready | (doing == Start.OVER)),
            may_be_large.eq(multiplied),
        ]
        ranges = (second[place : place + 8] for place in (bits - 1, CHANCE_BITS))
        last_places = Mux(second_finds, self.highest([*Mux(second_factor, *ranges)]), rest[:3])
        shifted = self.shifted(m, second, last_places, (0, 1, 2))
        whole = Cat(last_places[:3], rest[3:])
        with m.If(second_factor):
            m.d.sync += [self.factor.eq(shifted), self.places.eq(whole)]
        log_whole = Signal(6)
        was_log = Signal()
        was_gain = Signal()
        m.d.sync += [log_whole.eq(whole), was_log.eq(is_log), was_gain.eq(doing == Start.GAIN)]
        m.d.comb += self.table.addr.eq(
            Mux(
                is_log,
                self.log_address(shifted, C(0, 1)),
                Mux(doing == Start.GAIN, self.gain_address, self.power_address),
            )
        )
        found, data = shifted[CHANCE_BITS : CHANCE_BITS + WIDTH], self.table.data
        looked_up = Signal()
        large = Signal()
        m.d.comb += [looked_up.eq(was_log | was_gain), large.eq(may_be_large & self.too_large(shifted))]
        low = Mux(looked_up, Cat(data[:LOG_BITS], Mux(was_log, log_whole, data[LOG_BITS:])), found[:TABLE_BITS])
        with m.If(ends | looked_up):
            m.d.sync += [
                self.result.eq(Cat(low, found[TABLE_BITS:]).as_signed()),
                self.up.eq((shifted[:CHANCE_BITS] + self.chance)[-1] & ~looked_up),
            ]
        with m.If(looked_up):
            m.d.sync += self.result[TABLE_BITS:].eq(0)
        with m.If(large):
            m.d.sync += [
                self.result[:RESULT_BITS].eq(0),
                self.result[RESULT_BITS].eq(1),
                self.result[RESULT_BITS + 1 :].eq(shifted[-1].replicate(WIDTH - RESULT_BITS - 1)),
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
