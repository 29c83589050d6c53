"""The reciprocal of m_s."""

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.spec.formats import reciprocal as spec


class Reciprocal(wiring.Component):
    """q(m) = ⌊2^(f+g)/m⌋ from a table in block RAM.

    Latency: q is there in the clock after `enable`, and stays until the next.

    Parameters
    ----------
    reciprocal : spec.reciprocal.Reciprocal
        Widths and contents.

    Members
    -------
    m : In(range(max_m + 1))
        1 … max_m.
    enable : In(1)
    q : Out(width)
    """

    def __init__(self, reciprocal: spec.Reciprocal) -> None:
        self._reciprocal = reciprocal
        super().__init__({"m": In(range(reciprocal.max_m + 1)), "enable": In(1), "q": Out(reciprocal.width)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        table = self._reciprocal
        m.submodules.table = memory = Memory(shape=table.width, depth=table.depth, init=table.table)
        read = memory.read_port()
        m.d.comb += [read.addr.eq(self.m), read.en.eq(self.enable), self.q.eq(read.data)]
        return m
