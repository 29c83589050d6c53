"""Both units of the tracking machine, serial and block, have these ports, this table and these addresses.

A unit makes products, logarithms, powers and shifts. It shifts to the right alone, with 8 bits below the LSB of the
result, which decide how it is rounded. A logarithm is the places until the leading one is at bit 8, and a table entry
for the bits behind; a power is a table entry, shifted.
"""

from amaranth import C, Cat, Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, only_if
from tachometry.spec.formats.tracking import (
    CHANCE_BITS,
    EXP_INDEX,
    GAIN_STEPS,
    GAINS,
    GAINS_FROM,
    LOG_BITS,
    LOG_INDEX,
    POWERS,
    RESULT_BITS,
    TABLE_BITS,
    WIDTH,
)
from tachometry.spec.formats.tracking_code import HOW_BITS, Program
from tachometry.spec.formats.tracking_units import BLOCK, Start

_GAIN_LOW = LOG_BITS - (GAIN_STEPS - 1).bit_length()


class Unit(Box):
    """Ports and table of a unit; `_work` of a subclass adds the rest."""

    def __init__(self, program: Program) -> None:
        super().__init__(
            begin=In(1),  # a tick begins: results are rounded to the nearest until the event has a number
            start=In(Start),  # the operation that begins; none does while the serial unit is busy
            how=In(HOW_BITS),  # number of the shift, or of the table of gains
            sum=In(signed(WIDTH)),  # the operand; the block unit takes it a clock later
            **only_if(program.times == BLOCK, coming=In(WIDTH // 2)),  # its lower half, a clock earlier
            **only_if(program.times != BLOCK, busy=Out(1)),  # the result is not there yet
            result=Out(signed(WIDTH)),
            up=Out(1),  # the result is to be rounded up, by one
        )
        self._program = program
        self._bits = program.form.factor_bits
        self._shifts = (*program.shifts, *[(Start.OVER, 0)] * ((1 << HOW_BITS) - len(program.shifts)))  # by `how`
        self.factor = Signal(self.factor_bits, reset_less=True)
        self.places = Signal(6, reset_less=True)  # that the factor went
        self.doing = Signal(Start)  # in the clock after the start
        self.how_done = Signal(HOW_BITS)
        self.chance = Signal(CHANCE_BITS)  # the number of the event, its bits reversed
        self.operand = self.sum  # in the clock after the start
        self.with_sum = self.doing  # what begins with `sum`
        values = program.form.tables
        self.tables = Memory(shape=TABLE_BITS, depth=1 << (len(values) - 1).bit_length(), init=values)
        self.table = self.tables.read_port()

    def build(self, m: Module) -> None:
        m.d.sync += [self.doing.eq(self.start), self.how_done.eq(self.how)]
        with m.If(self.begin):
            m.d.sync += self.chance.eq(1 << CHANCE_BITS - 1)
        with m.Elif(self.with_sum == Start.CHANCE):
            m.d.sync += self.chance.eq(Cat(reversed(self.sum[:CHANCE_BITS])))
        m.submodules.tables = self.tables
        self._work(m)

    @property
    def factor_bits(self) -> int:
        """Bits that the factor is kept in."""
        return self._bits

    @property
    def whole(self) -> Value:
        """The whole part of a logarithm whose power is meant."""
        return self.operand[LOG_BITS : LOG_BITS + 9].as_signed()

    @property
    def power_address(self) -> Value:
        """Where the power of the operand stands in the table."""
        return self.operand[LOG_BITS - EXP_INDEX : LOG_BITS]

    @property
    def gain_address(self) -> Value:
        """Where the gain of the operand stands in the table: 16 an octave, from X = 1/4 on."""
        place = (~self.operand)[_GAIN_LOW : _GAIN_LOW + 9]
        beyond = place[8] | (place[7] & place[5:7].any())  # beyond the last
        gain = Mux(beyond, GAINS_FROM - 1, place[: GAINS.bit_length() - 1])
        last = self.how_done[:2].all() if len(self._program.form.gains) > 3 else C(0, 0)  # behind all else
        return Cat(gain, (self.how_done[:2] + len(POWERS) // GAINS)[:3], last)

    def _work(self, m: Module) -> None:
        raise NotImplementedError

    @staticmethod
    def log_address(shifted: Value, above: Value) -> Value:
        """Return where the logarithm stands of what is behind the leading one at bit 8, or at bit 9 if `above`."""
        return Cat(shifted[CHANCE_BITS - LOG_INDEX : CHANCE_BITS], shifted[CHANCE_BITS] | ~above, above, C(1, 1))

    @staticmethod
    def too_large(product: Value) -> Value:
        """Return whether a product is beyond ±2^36."""
        most = product[CHANCE_BITS + RESULT_BITS :]
        return most != product[-1].replicate(len(most))
