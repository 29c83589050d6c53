"""Gates of `spec.core.extras.probe`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.probe import Probe, packed


@dataclass(frozen=True)
class FinePosition:
    """Fine position that probes latch, with its age."""

    width: int  # bits
    age_width: int  # bits of the age, which stays at its end
    latency: int  # clocks from the end of a period to the update with its fine position


class Gates(Box):
    """An edge of `level_probe` in clock c is in `probe_valid` in clock c + `latency`.

    With it are the sum of all steps through clock c and the clocks since the latest of them, and, with a fine position,
    the one that was shown then and its age. `probe_arm` arms from the next clock on; all are armed after reset.

    - `edges`: The edges that each probe latches after reset, in bits `RISING` and `FALLING`.
    - `position_width`, `time_width`: Bits of the position, and of the time, which stays at its end.
    - `latency`: Clocks from a step to the position that has it, at least 2.
    """

    def __init__(
        self,
        edges: Sequence[int],
        position_width: int,
        time_width: int,
        latency: int = 2,
        fine: FinePosition | None = None,
    ) -> None:
        self._probes, self._latency, self._time_width, self._fine = len(edges), latency, time_width, fine
        shown = {"valid": 1, "position": signed(position_width), "time": time_width}
        fine_inputs = {}
        if fine is not None:
            shown |= {"fine": signed(fine.width), "age": fine.age_width}
            fine_inputs = {"velocity_valid": In(1), "position_fine": In(signed(fine.width))}
        super().__init__(
            level_probe=In(self._probes),
            ready_probe=In(self._probes),
            step=In(signed(2)),
            next_position=In(signed(position_width)),
            probe_edges=In(2 * self._probes, init=packed(edges)),
            probe_arm=In(self._probes),
            **fine_inputs,
            probed=Out(self._probes),
            **{f"probe_{name}_{k}": Out(shape) for k in range(self._probes) for name, shape in shown.items()},
        )

    @classmethod
    def of(cls, extra: Probe, spec: TachometerSpec) -> Self:
        port, fine = extra.fine(spec), None
        if port is not None:
            latency = spec.latency.tick + spec.latency.tick_to_update
            fine = FinePosition(port.width, extra.age_width(spec), latency)
        return cls(extra.edges, spec.position_width, extra.time_width(spec), spec.latency.tick, fine)

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time since the last count, which a simulation may move on."""
        widths = {"since": self._time_width, "age": self._fine.age_width if self._fine else 0}
        return tuple(IdleCounter(name, 1, ((1 << width) - 1,)) for name, width in widths.items() if width)

    def build(self, m: Module) -> None:
        level, ready, step = delay(m, self.level_probe, self.ready_probe, self.step[0], clocks=self._latency - 2)
        since = Signal(self._time_width, init=-1)  # of the clock before
        now = Signal.like(since)
        past = Signal.like(self.level_probe)
        m.d.comb += now.eq(Mux(step, 0, since + ~since.all()))
        m.d.sync += [since.eq(now), past.eq(level)]
        rising, falling = self.probe_edges[::2], self.probe_edges[1::2]
        edge = Signal.like(self.level_probe)
        m.d.sync += edge.eq(ready & ((level & ~past & rising) | (~level & past & falling)))
        latches = Signal.like(self.level_probe)
        m.d.comb += latches.eq(edge & ~self.probed)
        m.d.sync += [
            self.probed.eq((self.probed | edge) & ~self.probe_arm),
            Cat(getattr(self, f"probe_valid_{k}") for k in range(self._probes)).eq(latches),
        ]
        latched = {"position": self.next_position, "time": since}
        if self._fine is not None:
            # Of what was shown in the clock before, to an edge that is known now.
            age = Signal(self._fine.age_width, init=-1)
            shown = Mux(self.velocity_valid, self._fine.latency + 1 - self._latency, age + ~age.all())
            m.d.sync += age.eq(shown)
            latched |= {"fine": self.position_fine, "age": shown}
        for k in range(self._probes):
            with m.If(latches[k]):
                m.d.sync += [getattr(self, f"probe_{name}_{k}").eq(value) for name, value in latched.items()]
