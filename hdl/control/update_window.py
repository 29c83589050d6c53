"""A window sums what happens between two updates."""

from amaranth import Module, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.control.form import ControlForm


class UpdateWindow(Box):
    """Holds the velocity, counts the control ticks since the update before, and sums their currents.

    An update waits for the next control tick. Of several that come between two, the first is taken, as the currents of
    a later one would be of no tick. Where nothing has come for `longest` control ticks, the velocity that is held is
    taken once more. A conventional observer takes the velocity that is held at every control tick, with the current of
    the one before.
    """

    def __init__(self, form: ControlForm) -> None:
        self._form = form
        self._longest = form.longest
        limit = form.current_limit.bit_length() + 1
        super().__init__(
            update=In(1),
            measured=In(1),  # with `update`: a measurement; else the velocity is only held until one comes
            tick=In(1),
            clear=In(1),  # the window has been used, and a new one begins
            add=In(1),  # a control tick is over, and `current` is that of its end
            velocity=In(signed(form.velocity_width)),  # valid with `update`
            current=In(signed(limit)),
            held=Out(signed(form.velocity_width)),
            due=Out(1),  # valid with `tick`: the window is to be used
            n=Out(range(form.longest + 1)),
            current_sum=Out(signed(form.most_sum.bit_length() + 1)),  # ΣI
        )

    def build(self, m: Module) -> None:
        waits = Signal()
        if self._form.synchronised:
            ticked = Signal()  # before the first control tick there is no current
            m.d.comb += self.due.eq(waits | (self.n == self._longest))
            with m.If(self.tick):
                m.d.sync += [ticked.eq(1), waits.eq(0)]
            with m.If(self.update & self.measured & (ticked | self.tick)):
                m.d.sync += waits.eq(1)
            with m.If(self.update & (~waits | self.tick)):
                m.d.sync += self.held.eq(self.velocity)
        else:
            m.d.comb += self.due.eq(1)
            with m.If(self.update):
                m.d.sync += self.held.eq(self.velocity)
        with m.If(self.add):
            m.d.sync += [self.n.eq(self.n + 1), self.current_sum.eq(self.current_sum + self.current)]
        with m.If(self.clear):
            m.d.sync += [self.n.eq(0), self.current_sum.eq(0)]
