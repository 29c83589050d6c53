"""The unit of the tracking machine: products, logarithms, powers and shifts; one that is quick, and one that is small.

Both shift to the right alone. What is shifted has 8 bits below the LSB of the result, which decide how it is rounded. A
logarithm is the number of places until the leading one is at bit 8, and a table of what is behind it. A power is a
number from a table, shifted.
"""

from amaranth import Array, C, Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.enum import Enum
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.spec.formats.tracking import (
    CHANCE_BITS,
    DROPPED,
    EXP_INDEX,
    GAIN_STEPS,
    GAINS,
    LOG_BITS,
    LOG_INDEX,
    POWER_BITS,
    RESULT_BITS,
    WIDTH,
)
from tachometry.spec.formats.tracking_code import BY_FACTOR, HOW_BITS, Program, Start

TABLE_BITS = 18
_LOW = CHANCE_BITS - DROPPED  # zeros below a product
_TOP = CHANCE_BITS + WIDTH  # bits of what is shifted, unless it is a product


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
        The operand, a clock later.
    busy : Out(1)
        The result is not there yet.
    result : Out(signed)
    up : Out(1)
        It is to be rounded up, by one.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._bits = program.form.factor_bits
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

    def elaborate(self, platform: object) -> Module:
        m = Module()
        bits = self._bits
        doing = Signal(Start)
        how = Signal(HOW_BITS)
        self.doing = doing
        self.factor = Signal(bits, reset_less=True)
        self.places = Signal(6, reset_less=True)
        m.d.sync += [doing.eq(self.start), how.eq(self.how)]
        # The number of the event, its bits reversed.
        self.chance = Signal(CHANCE_BITS)
        with m.If(self.begin):
            m.d.sync += self.chance.eq(1 << CHANCE_BITS - 1)
        with m.Elif(doing == Start.CHANCE):
            m.d.sync += self.chance.eq(Cat(reversed(self.sum[:CHANCE_BITS])))
        values = self._program.tables
        m.submodules.tables = tables = Memory(shape=TABLE_BITS, depth=1 << (len(values) - 1).bit_length(), init=values)
        self.table = tables.read_port()
        # The place in a table of gains: 16 an octave, from X = 1/4 on.
        low = LOG_BITS - (GAIN_STEPS - 1).bit_length()
        place = Signal(9)
        gain = Signal(range(GAINS))
        m.d.comb += [
            place.eq((~self.sum)[low : low + 9] - 2 * GAIN_STEPS),
            gain.eq(Mux(place >= GAINS, GAINS - 1, place)),
        ]
        first_gains = (len(values) - 3 * GAINS) // GAINS
        self.gain_address = Cat(gain, (how[:2] + first_gains)[:3])
        self.power_address = self.sum[LOG_BITS - EXP_INDEX : LOG_BITS]
        # How far powers, products, and all others, go to the right.
        named = Signal(6)
        shifts = (*self._program.shifts, *[0] * ((1 << HOW_BITS) - len(self._program.shifts)))
        m.d.comb += named.eq(Array(C(shift, 6) for shift in shifts)[how])
        places = Signal(signed(11))
        whole = self.sum[LOG_BITS : LOG_BITS + 9].as_signed()
        m.d.comb += places.eq(RESULT_BITS - whole)
        nothing = places[6:-1].any() & ~places[-1]
        self.of_power = Mux(places[-1] | ~places.any(), 1, places[:6] | nothing.replicate(6))
        self.of_product = (named + _LOW - self.places)[:6]
        self.of_shift = Mux(how == BY_FACTOR, self.places, named)
        # What is shifted.
        size = (self.sum ^ ((doing == Start.LOG) & self.sum[-1]).replicate(WIDTH))[:WIDTH]
        self.of_sum = Cat(C(0, CHANCE_BITS), size)
        above = CHANCE_BITS + RESULT_BITS - POWER_BITS
        self.of_table = Cat(C(0, above), self.table.data[:POWER_BITS], C(1, 1))
        self._work(m)
        return m

    def _work(self, m: Module) -> None:
        raise NotImplementedError

    def log_address(self, shifted: Value) -> Value:
        """Return where the logarithm stands of what is behind the leading one at bit 8."""
        return Cat(shifted[CHANCE_BITS - LOG_INDEX : CHANCE_BITS], C((1 << EXP_INDEX) >> LOG_INDEX, 10 - LOG_INDEX))

    def beyond(self, shifted: Value, step: int, factor: Value) -> Value:
        """Tell whether the leading one is `step` places or more above where it belongs."""
        of_log, of_factor = (shifted[place + step : _TOP].any() for place in (CHANCE_BITS, self._bits - 1))
        return Mux(factor, of_factor, of_log)

    @staticmethod
    def too_large(product: Value) -> Value:
        """Tell whether a product is beyond ±2^36."""
        most = product[CHANCE_BITS + RESULT_BITS :]
        return most != product[-1].replicate(len(most))


class QuickUnit(Unit):
    """A multiplier of the FPGA, and a barrel shifter in two stages; `tracking_code.QUICK` has its times."""

    def _work(self, m: Module) -> None:
        bits, doing = self._bits, self.doing
        width = WIDTH + bits + _LOW
        left = Signal(3)
        last = Signal(Start)
        latencies = Array(C(max(getattr(self._program.times, item.name.lower(), 1) - 1, 0), 3) for item in Start)
        m.d.comb += self.busy.eq(left.any())
        m.d.sync += [left.eq(Mux(left.any(), left - 1, latencies[self.start])), last.eq(doing)]
        product = Signal(signed(WIDTH + bits), reset_less=True)
        of_product = Signal(6)
        of_power = Signal(6)
        m.d.sync += [
            product.eq(self.sum * self.factor),
            of_product.eq(self.of_product),
            of_power.eq(self.of_power),
        ]
        # First stage: by 32, 16 and 8.
        multiplied, raised = last == Start.TIMES, last == Start.EXP
        finds, factor = (doing == Start.LOG) | (doing == Start.BY), doing == Start.BY
        value = Signal(signed(width))
        places = Signal(6)
        m.d.comb += [
            value.eq(
                Mux(
                    multiplied,
                    Cat(C(0, _LOW), product).as_signed(),
                    Mux(raised, Cat(self.of_table, C(0, 1)).as_signed(), self.of_sum.as_signed()),
                )
            ),
            places.eq(Mux(multiplied, of_product, Mux(raised, of_power, self.of_shift))),
        ]
        half, count = self._stage(m, value, places, finds, factor, (5, 4, 3))
        # Second stage: by 4, 2 and 1.
        second = Signal(signed(width), reset_less=True)
        rest = Signal(3)
        high = Signal(3)
        second_finds = Signal()
        second_factor = Signal()
        ends = Signal()
        is_log = Signal()
        may_be_large = Signal()
        m.d.sync += [
            second.eq(half),
            rest.eq(places),
            high.eq(count[3:]),
            second_finds.eq(finds),
            second_factor.eq(factor),
            is_log.eq(doing == Start.LOG),
            ends.eq(multiplied | raised | (doing == Start.OVER)),
            may_be_large.eq(multiplied),
        ]
        shifted, count = self._stage(m, second, rest, second_finds, second_factor, (2, 1, 0))
        whole = Cat(count[:3], high)
        with m.If(second_factor):
            m.d.sync += [self.factor.eq(shifted), self.places.eq(whole)]
        log_whole = Signal(6)
        was_log = Signal()
        was_gain = Signal()
        m.d.sync += [log_whole.eq(whole), was_log.eq(is_log), was_gain.eq(doing == Start.GAIN)]
        m.d.comb += self.table.addr.eq(
            Mux(is_log, self.log_address(shifted), Mux(doing == Start.GAIN, self.gain_address, self.power_address))
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

    def _stage(
        self, m: Module, value: Value, places: Value, finds: Value, factor: Value, of: tuple[int, ...]
    ) -> tuple[Value, Signal]:
        """Shift by some powers of two; what comes out, and by how much."""
        count = Signal(6, name=f"count_{of[0]}")
        for place in of:
            step = 1 << place
            taken = Signal(name=f"shifts_{step}")
            m.d.comb += taken.eq(Mux(finds, self.beyond(value, step, factor), places[place]))
            shifted = Signal(signed(len(value)), name=f"by_{step}")
            m.d.comb += [shifted.eq(Mux(taken, value >> step, value)), count[place].eq(taken)]
            value = shifted
        return value, count


class State(Enum):
    """Lists what the small unit does."""

    RESTS = 0
    MULTIPLIES = 1
    SHIFTS = 2
    LOOKS_UP = 3


class SmallUnit(Unit):
    """One register that is shifted by 16, by 4 or by 1 a clock, and adds for products; see `small_times`."""

    def _work(self, m: Module) -> None:
        bits, doing = self._bits, self.doing
        width = WIDTH + bits + _LOW
        state = Signal(State)
        work = Signal(signed(width), reset_less=True)
        operand = Signal(signed(WIDTH), reset_less=True)
        # Places to be shifted, by 1, 4 and 16; where the leading one is sought, those that it was.
        digits = [Signal(2, name=f"by_{step}", reset_less=True) for step in (1, 4, 16)]
        steps = Signal(range(bits), reset_less=True)
        begins = (doing != Start.NONE) & (doing != Start.CHANCE)
        m.d.comb += [
            self.busy.eq(begins | (state != State.RESTS)),
            self.result.eq(work[CHANCE_BITS : CHANCE_BITS + WIDTH].as_signed()),
        ]
        with m.If(doing == Start.TIMES):
            m.d.sync += operand.eq(self.sum)
        is_log, is_factor, is_product, is_power = (
            Signal(name=f"was_{name}", reset_less=True) for name in ("log", "factor", "product", "power")
        )
        with m.If(begins):
            m.d.sync += [
                is_log.eq(doing == Start.LOG),
                is_factor.eq(doing == Start.BY),
                is_product.eq(doing == Start.TIMES),
                is_power.eq(doing == Start.EXP),
            ]
        finds = Signal()
        shifts, multiplies, looks = (state == item for item in (State.SHIFTS, State.MULTIPLIES, State.LOOKS_UP))
        one, near, far = taken = [Signal(name=f"shifts_{step}") for step in (1, 4, 16)]
        beyond = [Signal(name=f"beyond_{step}", reset_less=True) for step in (1, 4, 16)]
        ends = Signal()
        large = Signal()
        too_large = Signal()
        m.d.comb += [
            finds.eq(is_log | is_factor),
            *(
                go.eq(shifts & Mux(finds, flag, digit.any()))
                for go, flag, digit in zip(taken, beyond, digits, strict=True)
            ),
            ends.eq(shifts & ~one & ~near & ~far),
            large.eq(ends & is_product & too_large),
        ]
        # A bit of the factor a clock; without it, it is a shift by 1.
        total = Signal(signed(WIDTH + 1))
        m.d.comb += total.eq(work[_LOW + bits :].as_signed() + Mux(multiplies & work[_LOW], operand, 0))
        # What is loaded: the sum, a factor, what a table has, or the greatest product.
        of_sum = begins & (doing != Start.TIMES)
        found = Cat(self.table.data[:LOG_BITS], Mux(is_log, Cat(*digits), self.table.data[LOG_BITS:]))
        load = (
            (self.of_sum.as_signed() & of_sum.replicate(width))
            | ((Cat(C(0, _LOW), self.factor)) & (begins & (doing == Start.TIMES)).replicate(width))
            | (self.of_table & (looks & is_power).replicate(width))
            | (Cat(C(0, CHANCE_BITS), found) & (looks & ~is_power).replicate(width))
        )
        choice = Signal(2)
        m.d.comb += choice.eq(Mux(begins | looks, 3, Mux(far, 2, near & ~far)))
        following = Signal(signed(width))
        with m.Switch(choice):
            with m.Case(0):
                m.d.comb += following.eq(Cat(work[1 : _LOW + bits], total))
            with m.Case(1):
                m.d.comb += following.eq(work >> 4)
            with m.Case(2):
                m.d.comb += following.eq(work >> 16)
            with m.Case(3):
                m.d.comb += following.eq(load)
        # How far it is to be shifted is known as soon as what is shifted.
        of_factor = Mux(begins, doing == Start.BY, is_factor)
        with m.If(begins | looks | multiplies | one | near | far):
            m.d.sync += [work.eq(following), too_large.eq(self.too_large(following))]
            for flag, step in zip(beyond, (1, 4, 16), strict=True):
                m.d.sync += flag.eq(self.beyond(following, step, of_factor))
        with m.If(large):
            m.d.sync += work[: CHANCE_BITS + RESULT_BITS].eq(0)
            m.d.sync += work[CHANCE_BITS + RESULT_BITS].eq(1)
            m.d.sync += work[CHANCE_BITS + RESULT_BITS + 1 :].eq(work[-1].replicate(width))
        with m.If(begins):
            given = Mux(doing == Start.EXP, self.of_power, Mux(doing == Start.TIMES, self.of_product, self.of_shift))
            given = Mux((doing == Start.LOG) | (doing == Start.BY), 0, given)
            m.d.sync += Cat(*digits).eq(given)
        with m.Elif(shifts):
            for digit, go, not_yet in zip(digits, taken, (far | near, far, C(0, 1)), strict=True):
                with m.If(go & ~not_yet):
                    m.d.sync += digit.eq(Mux(finds, digit + 1, digit - 1))
        m.d.comb += self.table.addr.eq(
            Mux(
                doing == Start.EXP,
                self.power_address,
                Mux(doing == Start.GAIN, self.gain_address, self.log_address(work)),
            )
        )
        with m.If(looks | ends):
            m.d.sync += self.up.eq((work[:CHANCE_BITS] + self.chance)[-1] & ~large & ~looks)
        with m.If(ends & is_factor):
            m.d.sync += [self.factor.eq(work), self.places.eq(Cat(*digits))]
        m.d.sync += steps.eq(Mux(multiplies, steps - 1, bits - 1))
        with m.If(begins):
            looked_up = (doing == Start.EXP) | (doing == Start.GAIN)
            begun = Mux(doing == Start.TIMES, State.MULTIPLIES, State.SHIFTS)
            m.d.sync += state.eq(Mux(looked_up, State.LOOKS_UP, begun))
        with m.Elif(multiplies & (steps == 0)):
            m.d.sync += state.eq(State.SHIFTS)
        with m.Elif(ends):
            m.d.sync += state.eq(Mux(is_log, State.LOOKS_UP, State.RESTS))
        with m.Elif(looks):
            m.d.sync += state.eq(Mux(is_power, State.SHIFTS, State.RESTS))
