"""The reciprocal of m_s is looked up or divided."""

from amaranth import Cat, Const, Module, Signal, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats import reciprocal as spec


class LookedUpReciprocal(Box):
    """Looks q(m) up in a table in block RAM.

    Latency: q is there two clocks after m. The register behind the table is what the memories of many FPGAs have
    built in; without it, the way out of a memory and on to an adder limits the clock.
    """

    def __init__(self, reciprocal: spec.Reciprocal) -> None:
        self._reciprocal = reciprocal
        super().__init__(
            m=In(range(reciprocal.max_m + 1)),  # 1 … max_m
            moves=In(1),  # not used: see `DividedReciprocal`
            q=Out(reciprocal.width),
        )

    def build(self, m: Module) -> None:
        table = self._reciprocal
        m.submodules.table = memory = Memory(shape=table.width, depth=table.depth, init=table.table)
        read = memory.read_port()
        found = Signal(table.width, reset_less=True)
        m.d.comb += [read.addr.eq(self.m), read.en.eq(1), self.q.eq(found)]
        m.d.sync += found.eq(read.data)


class DividedReciprocal(Box):
    """Finds q(m) by a subtraction a clock.

    Latency: q is there `reciprocal.steps` and two clocks after `moves`, or after the reset, and stays until it moves.
    """

    def __init__(self, reciprocal: spec.DividedReciprocal) -> None:
        self._reciprocal = reciprocal
        super().__init__(
            m=In(range(reciprocal.max_m + 1)),  # 1 … max_m
            moves=In(1),  # the last clock with this m
            q=Out(reciprocal.width),
        )

    def build(self, m: Module) -> None:
        # The first digit is 1 in any case, and has gone through all others when the division is done.
        digits = Signal(self._reciprocal.steps)
        less_one = Signal(signed(len(self.m) + 1))  # R − 1
        adds = less_one[-1]
        multiple = Cat(self.m ^ (~adds).replicate(len(self.m)), ~adds).as_signed()
        with m.If(~digits[-1]):
            # −m is ~m + 1.
            total = Cat(~adds, Const(1, 1), less_one).as_signed() + Cat(~adds, multiple).as_signed()
            m.d.sync += [digits.eq(Cat(~adds, digits)), less_one.eq(total >> 1)]
        # A clock later: what tells that m moves comes late in its clock.
        moved = Signal()
        m.d.sync += moved.eq(self.moves)
        with m.If(moved):
            m.d.sync += [digits.eq(0), less_one.eq(0)]
        m.d.comb += self.q.eq(Cat(Const(1, 1), digits[:-1]))
