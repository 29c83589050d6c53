"""How old the velocity is."""

from amaranth import Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, only_if


class UpdateAge(Box):
    """Counts the ticks since the cause of the update, or from reset, on, up to `max_age`.

    Latency: none; in the clock of an update the age is `fresh`, and a tick in this clock counts already.

    - `fresh_width`: Bits of `fresh`; 0: it is always 0.
    """

    def __init__(self, max_age: int, fresh_width: int = 0) -> None:
        self._max_age, self._fresh_width = max_age, fresh_width
        super().__init__(
            tick=In(1),
            update=In(1),
            **only_if(fresh_width, fresh=In(fresh_width)),  # with `update`: ticks from its cause to it
            age=Out(range(max_age + 1)),
            before=Out(range(max_age + 1)),  # the age of the clock before
        )

    def build(self, m: Module) -> None:
        fresh: Value | int = 0
        if self._fresh_width:
            most = self._max_age
            fresh = self.fresh if (most + 1) >> self._fresh_width else Mux(self.fresh > most, most, self.fresh)
        age = Signal.like(self.age)  # without a tick in this clock
        m.d.comb += age.eq(Mux(self.update, fresh, self.before))
        m.d.comb += self.age.eq(age + (self.tick & (age != self._max_age)))
        m.d.sync += self.before.eq(self.age)
