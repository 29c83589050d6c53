"""Gates of `spec.core.extras.electrical`."""

from typing import Self

from amaranth import C, Module, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.count_angle import CountAngle
from tachometry.hdl.output.counted_angle import CountedAngle
from tachometry.hdl.output.tracked_angle import TrackedAngle
from tachometry.hdl.wires.delay import delay
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import REFUSED, REFUSED_BITS, ElectricalAngle
from tachometry.spec.formats.angles import LEAD_BITS, PLACE_BITS, SHOWN_BITS, Carried, Counted


class Gates(wiring.Component):
    """The angle of the counts, carried on to every clock, and a shift that `angle_set` and an offset make.

    A set in clock c takes the value of clock c + 1, and is in `angle` from clock c + 4 on.

    Parameters
    ----------
    latency : int
        Clocks from a step to the position that has it.
    widths : mapping of str to int
        Bits of the outputs of the method that are taken.
    marks : tuple of str
        Inputs for an index: `index_rises`, and `home_rises` where it is taken once. `angle_refused`: one behind the
        first may show lost counts.
    """

    def __init__(
        self,
        phases: Carried | Counted,
        latency: int,
        widths: dict[str, int],
        extra: ElectricalAngle,
        marks: tuple[str, ...] = (),
    ) -> None:
        corrects = REFUSED in marks
        self._latency, self._marks, self._corrects, self._offset = latency, marks, corrects, extra.offset
        self.count = CountAngle(phases.angles, corrects=corrects)
        velocity = widths["new_velocity"]
        self.phase: TrackedAngle | CountedAngle
        if isinstance(phases, Carried):
            self.phase = TrackedAngle(phases, velocity, widths["new_acceleration"])
        else:
            self.phase = CountedAngle(phases, velocity)
        super().__init__(
            {
                "step": In(signed(2)),
                **dict.fromkeys(("tick", "update", "angle_set", *(mark for mark in marks if mark != REFUSED)), In(1)),
                "position": In(PLACE_BITS),
                **{name: In(signed(width)) for name, width in widths.items()},
                "angle_value": In(SHOWN_BITS),
                "angle_offset": In(SHOWN_BITS, init=extra.offset),
                "angle_lead": In(LEAD_BITS, init=extra.lead),
                "angle": Out(SHOWN_BITS),
                "angle_valid": Out(1),
                **({REFUSED: Out(REFUSED_BITS)} if corrects else {}),
            }
        )

    @classmethod
    def of(cls, extra: ElectricalAngle, spec: TachometerSpec) -> Self:
        """Return the gates of this core."""
        widths = {"new_velocity": spec.velocity.native}
        if spec.tracked is not None:
            taken = {port.name: port.width for port in spec.method_ports}
            widths |= {f"new_{name}": taken[name] for name in ("acceleration", "position_fine")}
        marks = ("index_rises",) * (spec.index is not None) + ("home_rises",) * spec.front_end.index_once
        marks += (REFUSED,) * extra.corrects(spec)
        return cls(extra.phases(spec), spec.latency.tick, widths, extra, marks)

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.count = count = self.count
        m.submodules.phase = phase = self.phase
        (step,) = delay(m, self.step, clocks=self._latency - 1)
        indexed, sets = Signal(), Signal()
        m.d.sync += sets.eq(self.angle_set)
        rises = self.index_rises if "index_rises" in self._marks else C(0)
        home = self.home_rises if "home_rises" in self._marks else C(0)
        m.d.comb += [count.step.eq(step), count.zero.eq(rises)]
        with m.If(rises):
            m.d.sync += [indexed.eq(1), self.angle_valid.eq(1)]
        if self._corrects:
            m.d.comb += count.anew.eq(~indexed)
            with m.If(count.refused & ~self.angle_refused.all()):
                m.d.sync += self.angle_refused.eq(self.angle_refused + 1)
        with m.If(sets):
            m.d.sync += self.angle_valid.eq(1)
        with m.If(home):
            m.d.sync += [indexed.eq(0), self.angle_valid.eq(0)]
        if isinstance(phase, TrackedAngle):
            self._track(m, phase)
        else:
            m.d.comb += [phase.at.eq(count.angle), phase.step.eq(step), phase.moves.eq(count.clears)]
        m.d.comb += [
            phase.update.eq(self.update),
            phase.velocity.eq(self.new_velocity),
            phase.ahead.eq(self.angle_lead),
        ]
        self._shift(m, phase.angle[-SHOWN_BITS:], sets, rises & ~indexed)
        return m

    def _track(self, m: Module, phase: TrackedAngle) -> None:
        """Keep the angle and the place of the counts at a tick for the update that it has."""
        place = Signal(PLACE_BITS)
        with m.If(self.tick):
            m.d.sync += [phase.at.eq(self.count.angle), place.eq(self.position)]
        fine = self.new_position_fine
        bits = len(phase.fine) - PLACE_BITS
        m.d.comb += [
            phase.fine.eq((fine - (place << bits))[: len(phase.fine)]),
            phase.acceleration.eq(self.new_acceleration),
        ]

    def _shift(self, m: Module, angle: Value, sets: Value, first: Value) -> None:
        """Show the angle with what it was set to, or with nothing from the first index on, and with the offset."""
        difference, shift = Signal(SHOWN_BITS), Signal(SHOWN_BITS)
        offset = Signal(SHOWN_BITS, init=self._offset)
        with m.If(self.update):
            m.d.sync += offset.eq(self.angle_offset)
        with m.If(sets):
            m.d.sync += difference.eq(difference + self.angle_value - self.angle)
        with m.If(first):
            m.d.sync += difference.eq(0)
        m.d.sync += [shift.eq(difference + offset), self.angle.eq(angle + shift)]
