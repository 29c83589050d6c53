"""The M/T method."""

from amaranth import Module, Mux, Signal, Value

from tachometry.hdl.methods.timed import TimedDatapath
from tachometry.spec import MTTachometer


class MTMethod(TimedDatapath):
    """M/T-method datapath, eqs. (13) to (16) of Tsuji 2009: counts over the time that they take, longer than T_c.

    ½·s(opening) + counts between + ½·s(closing) is a sum over pairs of consecutive counts: a count of the same sign as
    the one before adds one, and a count of the other sign, which meets the same edge again, adds none.
    """

    def __init__(self, spec: MTTachometer) -> None:
        super().__init__(spec)
        self._min_periods = spec.min_periods

    def _window(self, m: Module) -> tuple[Value, Value, Value]:
        spec, timer = self._spec, self.gap_timer
        length = Signal(spec.interval_width, init=1)
        late = Signal()
        travelled = Signal.like(self.quotient_velocity.dividend)
        total = Signal.like(travelled)
        ends = Signal()
        opens = Signal()
        m.d.comb += [
            ends.eq(timer.count & timer.opened & late & (self.quotient_velocity.free if spec.may_be_late else 1)),
            opens.eq(ends | ~timer.opened),
            total.eq(travelled + (self._size if spec.on_lattice else Mux(self._same, self._one, 0))),
        ]
        with m.If(timer.period):
            m.d.sync += length.eq(length + 1)
            with m.If(length == self._min_periods):
                m.d.sync += late.eq(1)
            with m.If(opens):
                m.d.sync += [length.eq(1), late.eq(0)]
        with m.If(timer.count):
            m.d.sync += travelled.eq(Mux(opens, 0, total))
        if spec.bounds and spec.on_lattice:
            # Between the last edges of two ticks of opposite sign lies a count more or less than in the ticks after.
            quotient = self.quotient_velocity
            opening = Signal()
            with m.If(timer.count & opens):
                m.d.sync += opening.eq(timer.negative)
            m.d.comb += [quotient.less.eq(opening & ~timer.negative), quotient.more.eq(~opening & timer.negative)]
        return ends, total, Mux(ends, length, timer.age)
