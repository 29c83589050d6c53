"""How old the velocity is."""

from amaranth import Module, Mux
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class UpdateAge(wiring.Component):
    """Counts the ticks since the update, or since reset: those of its clock and later, up to some number.

    Latency: none; in the clock of an update the age is 0, and a tick counts from the clock after it.

    Parameters
    ----------
    max_age : int
        Where it stays.

    Members
    -------
    tick, update : In(1)
    age : Out(range(max_age + 1))
    before : Out(range(max_age + 1))
        What it was before an update of this clock.
    """

    def __init__(self, max_age: int) -> None:
        self._max_age = max_age
        super().__init__(
            {"tick": In(1), "update": In(1), "age": Out(range(max_age + 1)), "before": Out(range(max_age + 1))}
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.d.comb += self.age.eq(Mux(self.update, 0, self.before))
        m.d.sync += self.before.eq(self.age + (self.tick & (self.age != self._max_age)))
        return m
