"""The T method."""

from amaranth import Module, Mux, Value

from tachometry.hdl.methods.timed import TimedDatapath


class TMethod(TimedDatapath):
    """T-method datapath, eq. (9) of Tsuji 2009: one count over the time since the count before."""

    def _window(self, m: Module) -> tuple[Value, Value, Value]:
        timer, quotient, size = self.gap_timer, self.quotient_velocity, self._size
        many = size.any() & (size != 1) & (size != -1) if self._spec.form.on_lattice else Value.cast(0)
        m.d.comb += quotient.beyond_in.eq(many)
        return (
            timer.count & (timer.opened | many) & quotient.free,
            Mux(self._same | many, self._one, 0) if self._spec.form.on_lattice else self._way,
            Mux(many, 1, timer.age),
        )
