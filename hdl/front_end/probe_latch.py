"""The position at the edges of probe inputs."""

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.delay import delay


class ProbeLatch(wiring.Component):
    """Latches the position, and the time since the last count, when an input has an edge while it is armed.

    Latency: an edge of `level` in clock c is in `probe_valid` in clock c + `latency`, with the sum of all steps through
    clock c, and the clocks since the latest of them.

    Parameters
    ----------
    edges : int
        At which inputs latch after reset, two bits for each, the lower for rises.
    probes : int
    width : int
        Bits of the position.
    time_width : int
        Bits of the time, which stays at its end.
    latency : int
        That of the position, at least 2.
    fine_width, age_width : int
        Bits of a fine position, and of its age, which stays at its end; 0: there is none.
    update_latency : int
        Clocks from the end of a period to the update with its fine position.

    Members
    -------
    level, ready : In(probes)
        Levels of the inputs, and whether those of the clock before are real.
    step : In(signed(2))
        Of this clock, as the levels.
    position : In(signed(width))
        The position of the next clock.
    update : In(1)
    fine : In(signed(fine_width))
        What is shown from the update on.
    edges : In(2 * probes)
    arm : In(probes)
        The input is armed from the next clock on. All are after reset.
    probed : Out(probes)
        It has latched, and is not armed.
    probe_valid_0, probe_position_0, probe_time_0, probe_fine_0, probe_age_0 … : Out
        One clock with each that is latched; what is latched is held.
    """

    def __init__(
        self,
        edges: int,
        probes: int,
        width: int,
        time_width: int,
        latency: int = 2,
        *,
        fine_width: int = 0,
        age_width: int = 0,
        update_latency: int = 0,
    ) -> None:
        self._probes, self._latency, self._time_width = probes, latency, time_width
        self._age_width, self._update_latency = age_width, update_latency
        shown = {"valid": 1, "position": signed(width), "time": time_width}
        shown |= {"fine": signed(fine_width), "age": age_width} if fine_width else {}
        shown = {f"probe_{name}_{k}": Out(shape) for k in range(probes) for name, shape in shown.items()}
        self.latched = ("probed", *shown)
        super().__init__(
            {
                "level": In(probes),
                "ready": In(probes),
                "step": In(signed(2)),
                "position": In(signed(width)),
                "edges": In(2 * probes, init=edges),
                "arm": In(probes),
                **({"update": In(1), "fine": In(signed(fine_width))} if fine_width else {}),
                "probed": Out(probes),
                **shown,
            }
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time since the last count, which a simulation may move on."""
        widths = {"since": self._time_width, "age": self._age_width}
        return tuple(IdleCounter(name, 1, ((1 << width) - 1,)) for name, width in widths.items() if width)

    def elaborate(self, platform: object) -> Module:
        m = Module()
        level, ready, step = delay(m, self.level, self.ready, self.step[0], clocks=self._latency - 2)
        since = Signal(self._time_width, init=-1)  # of the clock before
        now = Signal.like(since)
        past = Signal.like(self.level)
        m.d.comb += now.eq(Mux(step, 0, since + ~since.all()))
        m.d.sync += [since.eq(now), past.eq(level)]
        rising, falling = self.edges[::2], self.edges[1::2]
        edge = Signal.like(self.level)
        m.d.sync += edge.eq(ready & ((level & ~past & rising) | (~level & past & falling)))
        latches = Signal.like(self.level)
        m.d.comb += latches.eq(edge & ~self.probed)
        m.d.sync += [
            self.probed.eq((self.probed | edge) & ~self.arm),
            Cat(getattr(self, f"probe_valid_{k}") for k in range(self._probes)).eq(latches),
        ]
        latched = {"position": self.position, "time": since}
        if self._age_width:
            # Of what was shown in the clock before, to an edge that is known now.
            age = Signal(self._age_width, init=-1)
            shown = Mux(self.update, self._update_latency + 1 - self._latency, age + ~age.all())
            m.d.sync += age.eq(shown)
            latched |= {"fine": self.fine, "age": shown}
        for k in range(self._probes):
            with m.If(latches[k]):
                m.d.sync += [getattr(self, f"probe_{name}_{k}").eq(value) for name, value in latched.items()]
        return m
