"""How long dt is, where it follows the speed."""

from collections.abc import Callable

from amaranth import Array, Cat, Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec import RairanTachometer


class DtShift(Box):
    """k of dt·2^k, and the end of dt from those of nominal ones.

    Latency: k and `last` are those of the new window in the clock after `opens`.

    - `spec`: With a target.
    """

    def __init__(self, spec: RairanTachometer, width: int) -> None:
        self._spec = spec
        super().__init__(
            opens=In(1),  # a window begins
            anew=In(1),  # with a count that has nothing to do with the window before
            nominal=In(1),  # the last clock of a nominal dt
            n=In(width),  # Ndt1 of the window that ends, or Nep1 − 1 if `high`
            high=In(1),
            shift=Out(range(spec.times.max_tick_shift + 1)),  # k of the window
            last=Out(1),  # with `nominal`: dt·2^k ends; without latency
        )

    def build(self, m: Module) -> None:
        spec, rule = self._spec, self._spec.form.adaptive_dt
        # 2^k − 1 has no register of its own: after an upset that could belong to another k.
        mask = self._soon(m, Cat(self.shift > k for k in range(spec.times.max_tick_shift)))
        passed = Signal(spec.times.max_tick_shift)
        m.d.comb += self.last.eq(self.nominal & (passed == mask))
        with m.If(self.nominal):
            m.d.sync += passed.eq(passed + 1)
        with m.If(self.last | self.opens):
            m.d.sync += passed.eq(0)
        rare, slow = (self._soon(m, self.of(limit), limit(0)) for limit in (rule.rare_to, rule.slow_from))
        down = Signal()
        up = Signal()
        falls = Signal()
        falling = Signal()  # to 0, unless there are enough counts on the way
        m.d.comb += [
            up.eq(~self.high | (self.n < rule.fewest - 1)),
            falls.eq(Mux(self.high, self.n < rare, self.n >= slow) | (falling & up)),
            down.eq(falls | (self.high & (self.n >= 2 * rule.fewest - 1))),
        ]
        with m.If(self.opens):
            m.d.sync += falling.eq(falls & (mask >> 1).any() & ~self.anew)
            with m.If(self.anew):
                m.d.sync += self.shift.eq(0)
            if spec.times.max_tick_shift & (spec.times.max_tick_shift + 1):  # an upset can lead beyond it
                with m.Elif(self.shift > spec.times.max_tick_shift):
                    m.d.sync += self.shift.eq(spec.times.max_tick_shift)
            with m.Elif(down), m.If(mask[0]):
                m.d.sync += self.shift.eq(self.shift - 1)
            with m.Elif(up & ~mask[-1]):
                m.d.sync += self.shift.eq(self.shift + 1)

    def of(self, constant: Callable[[int], int]) -> Value:
        """Return a constant that depends on k."""
        return Array([constant(min(k, self._spec.times.max_tick_shift)) for k in range(1 << len(self.shift))])[
            self.shift
        ]

    def _soon(self, m: Module, value: Value, init: int = 0) -> Value:
        """Return a constant that depends on k, from a register: a window lasts a dt at least, except at a reversal."""
        if self._spec.timing.tick_cycles == 1:
            return value
        held = Signal.like(value, init=init)
        m.d.sync += held.eq(value)
        return held
