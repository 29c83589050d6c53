"""A place that waits for a count goes to the middle of its count."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats.settling import Settling


class SettlingPlace(Box):
    """Gives the place of an update, which stays in its count as the velocity falls.

    A place that is 3/8 count away begins to wait when the velocity has fallen to half of that at the last count.
    Half a count is its limit then; the limit halves each time the velocity halves again. Of a place that is far away
    the low bits alone are compared. `taken` is high in the clock in which the update is taken, and velocity and place
    have been the same for four clocks.
    """

    def __init__(self, settling: Settling, place_width: int, velocity_width: int) -> None:
        self._settling = settling
        place = signed(place_width)
        ports = {"velocity": In(signed(velocity_width)), "forced": In(1), "taken": In(1)}
        super().__init__({**ports, "between": In(place), "settled": Out(place)})

    def build(self, m: Module) -> None:
        half = self._settling.half
        velocity = self.velocity >> self._settling.speed_shift
        near = self.between[: self._settling.place_bits]
        back = near[-1]
        waits = Signal()
        limit = Signal(range(half + 1), init=half)
        mark = Signal(len(velocity) - 1)
        size = Signal.like(mark)
        slow = Signal()
        stays = Signal()
        ahead = Signal(len(near) - 1)
        now = Signal.like(limit)
        ends = Signal()
        m.d.sync += [
            size.eq(velocity ^ velocity[-1].replicate(len(velocity))),
            slow.eq(size <= mark),
            ahead.eq(near ^ back.replicate(len(near))),
            stays.eq(self.forced & (waits | ((ahead >= half - (half >> 2)) & (slow | (limit < half))))),
            now.eq(Mux(slow, limit >> 1, limit)),
            ends.eq(stays & (ahead > now)),
        ]
        m.d.comb += self.settled.eq(Mux(ends, (now ^ back.replicate(len(near))).as_signed(), self.between))
        with m.If(self.taken):
            m.d.sync += waits.eq(stays)
            with m.If(~self.forced):
                m.d.sync += [limit.eq(half), mark.eq(size >> 1)]
            with m.Elif(slow):
                m.d.sync += [limit.eq(now), mark.eq(mark >> 1)]
