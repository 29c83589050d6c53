"""From levels to counts."""

from amaranth import Cat, Module, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class QuadratureDecoder(wiring.Component):
    """Quadrature decoder, x1, x2 or x4: one step of −1, 0 or +1 per clock, without latency.

    Forward is A before B: (A, B) = 00, 10, 11, 01. x4 counts every edge; x2 both edges of A; x1 the edges of A while B
    is low, rising forward and falling backward, so that a line which dithers on one edge never creeps. A clock in
    which both lines change has no direction: it counts nothing and is reported.

    Parameters
    ----------
    decoding : int
        Counts per period: 1, 2 or 4.

    Members
    -------
    level_a, level_b : In(1)
        Levels in this clock.
    ready : In(1)
        Low while the level before this one is not real: neither a step nor an error.
    step : Out(signed(2))
        −1, 0 or +1.
    decode_error : Out(1)
        Both lines changed.

    Raises
    ------
    ValueError
        If `decoding` is none of these.
    """

    def __init__(self, decoding: int) -> None:
        if decoding not in (1, 2, 4):
            raise ValueError(f"decoding must be 1, 2 or 4, not {decoding}")
        self._decoding = decoding
        super().__init__(
            {
                "level_a": In(1),
                "level_b": In(1),
                "ready": In(1),
                "step": Out(signed(2)),
                "decode_error": Out(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        past_a = Signal()
        past_b = Signal()
        m.d.sync += [past_a.eq(self.level_a), past_b.eq(self.level_b)]
        counted, backward, illegal = transition(self._decoding, self.level_a, self.level_b, past_a, past_b)
        count = Signal()
        m.d.comb += [
            count.eq(self.ready & counted),
            self.step.eq(Cat(count, count & backward)),
            self.decode_error.eq(self.ready & illegal),
        ]
        return m


def transition(
    decoding: int, level_a: Value, level_b: Value, past_a: Value, past_b: Value
) -> tuple[Value, Value, Value]:
    """Tell whether a change of levels counts, whether backward, and whether both have changed, which never counts."""
    change_a = level_a ^ past_a
    change_b = level_b ^ past_b
    counted = {
        1: change_a & ~change_b & ~level_b,
        2: change_a & ~change_b,
        4: change_a ^ change_b,
    }[decoding]
    backward = ~(level_a ^ past_b)
    return counted, backward, change_a & change_b
