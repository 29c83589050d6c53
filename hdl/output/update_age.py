"""How old the velocity is."""

from amaranth import Module, Mux
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class UpdateAge(wiring.Component):
    """Counts the ticks from the clock of the update, or from reset, on, up to `max_age`.

    Latency: none; in the clock of an update the age is 0, and a tick counts from the clock after it.

    Parameters
    ----------
    max_age : int
        The age at which the count stops.

    Members
    -------
    tick, update : In(1)
    age : Out(range(max_age + 1))
    before : Out(range(max_age + 1))
        The age without an update in this clock.
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
