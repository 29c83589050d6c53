"""The T method."""

from amaranth import Const, Module, Mux, Value

from tachometry.hdl.methods.timed import TimedDatapath


class TMethod(TimedDatapath):
    """T-method datapath, eq. (9) of Tsuji 2009: one count over the time since the count before."""

    def _window(self, m: Module) -> tuple[Value, Value, Value, Value]:
        timer, quotient = self.gap_timer, self.quotient_velocity
        opened: Value = timer.count | (timer.opened & ~timer.overdue)
        time: Value = timer.age
        if self._spec.form.on_lattice:
            m.d.comb += quotient.beyond_in.eq(_many(self.pulse_count))
            opened, time = opened | _many(self.next_count), Mux(quotient.beyond_in, 1, time)
        return timer.count_before & opened & quotient.free_before, Const(0), self._way, time

    @property
    def _way(self) -> Value:
        if not self._spec.form.on_lattice:
            return super()._way
        return Mux(self._same | self.quotient_velocity.beyond_in, Mux(self.pulse_count[-1], -1, 1), 0)


def _many(size: Value) -> Value:
    """Return whether a tick had more than one count."""
    return size.any() & (size != 1) & (size != -1)
