"""The watch of the encoder, for what is wrong with it."""

from collections.abc import Mapping
from types import MappingProxyType

from amaranth import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, idle_of
from tachometry.hdl.front_end.open_circuit import OpenCircuit
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.spec.core.health import FAULT_WIDTH, FAULTS_WIDTH, OPEN, Fault


class EncoderWatch(wiring.Component):
    """Watches the lines of the encoder, and keeps the first fault.

    Latency: a fault that is seen in clock c is at the outputs in clock c + 1; counts that are wrong between two indices
    are seen in the clock after `index_valid`.

    Parameters
    ----------
    second : int
        Clocks within which edges and errors are counted; then they are counted anew.
    edges : int
        So many edges of a line without one of the other, and none of both at once, are a fault of the other.
    errors : int
        So many illegal transitions are none yet; one more is.
    counts_per_rev, position_width : int
        Counts from index to index, and bits of a position; 0: there is no index.
    index_reset : bool
        The index sets the position to 0.
    presets : bool
        Something else sets the position.
    complements : mapping of str to int
        Lines that come with their complements, and for how many clocks a line may equal it.
    misses : bool
        The index is taken in a state, which it may miss.

    Members
    -------
    level_a, level_b : In(1)
    ready : In(1)
        The levels before these are real.
    step : In(signed(2))
    decode_error : In(1)
    index_valid : In(1)
    index_position : In(signed(position_width))
        Only with an index.
    index_missed : In(1)
        Only if it may.
    preset : In(1)
        The position is being set; a turn in which it is, is not checked. Only if there are presets.
    equal_a, equal_b, equal_z : In(1)
        The line equals its complement; of `complements`.
    clear : In(1)
        All that is kept is 0 in the next clock.
    seen : Out(1)
        There is a fault in this clock.
    health : Out(FAULT_WIDTH)
        The first fault since `clear`, as `spec.core.health.Fault` numbers them.
    faults : Out(FAULTS_WIDTH)
        Clocks with a fault since then; stays at its end.
    index_error : Out(signed(position_width))
        Counts by which the latest turn that was wrong went too far forward, which wrap; only with an index.
    """

    def __init__(
        self,
        *,
        second: int,
        edges: int,
        errors: int,
        counts_per_rev: int = 0,
        position_width: int = 0,
        index_reset: bool = False,
        presets: bool = False,
        complements: Mapping[str, int] = MappingProxyType({}),
        misses: bool = False,
    ) -> None:
        self._edges = edges
        self._errors = errors
        self._turn = counts_per_rev
        self._index_reset = index_reset
        self._presets = presets
        self.window = SamplingClock(second)
        self.open = {line: OpenCircuit(clocks) for line, clocks in complements.items()}
        position = signed(max(position_width, 1))
        index = {"index_valid": In(1), "index_position": In(position), "index_error": Out(position)}
        super().__init__(
            {
                **dict.fromkeys(("level_a", "level_b", "ready", "decode_error", "clear"), In(1)),
                **{f"equal_{line}": In(1) for line in complements},
                "step": In(signed(2)),
                **(index if position_width else {}),
                "seen": Out(1),
                **({"preset": In(1)} if presets else {}),
                **({"index_missed": In(1)} if misses else {}),
                "health": Out(FAULT_WIDTH),
                "faults": Out(FAULTS_WIDTH),
            }
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The times within a second and of equal lines, which a simulation may move on."""
        return idle_of({"window": self.window} | {f"open_{line}": box for line, box in self.open.items()})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.window = self.window
        a_stands, b_stands = self._standing(m)
        seen = {Fault.A_STANDS: a_stands, Fault.B_STANDS: b_stands, Fault.ILLEGAL: self._illegal(m)}
        if self._turn:
            seen[Fault.INDEX_COUNTS] = self._index(m)
        for line, box in self.open.items():
            m.submodules[f"open_{line}"] = box
            m.d.comb += [box.equal.eq(getattr(self, f"equal_{line}")), box.clear.eq(self.clear)]
            seen[OPEN[line]] = box.open
        if hasattr(self, "index_missed"):
            seen[Fault.INDEX_MISSED] = self.index_missed
        code: Value = Value.cast(0)
        for fault in sorted(seen, reverse=True):
            code = Mux(seen[fault], fault, code)
        m.d.comb += self.seen.eq(Cat(seen.values()).any())
        with m.If(self.seen):
            with m.If(self.health == 0):
                m.d.sync += self.health.eq(code)
            with m.If(~self.faults.all()):
                m.d.sync += self.faults.eq(self.faults + 1)
        with m.If(self.clear):
            m.d.sync += [self.health.eq(0), self.faults.eq(0)]
        return m

    def _standing(self, m: Module) -> tuple[Value, Value]:
        """Detect that a line has had so many edges without one of the other: A stands, B stands."""
        past_a = Signal()
        past_b = Signal()
        of_b = Signal()
        alone = Signal(range(self._edges))  # edges of a line since one of the other
        m.d.sync += [past_a.eq(self.level_a), past_b.eq(self.level_b)]
        change_a = self.ready & (self.level_a ^ past_a)
        change_b = self.ready & (self.level_b ^ past_b)
        again = alone.any() & (of_b == change_b)
        last = Signal()
        m.d.comb += last.eq((change_a ^ change_b) & again & (alone == self._edges - 1))
        with m.If(change_a & change_b):
            m.d.sync += alone.eq(0)
        with m.Elif(change_a | change_b):
            m.d.sync += [of_b.eq(change_b), alone.eq(Mux(last, 0, Mux(again, alone + 1, 1)))]
        with m.If(self.window.last):
            m.d.sync += alone.eq(0)
        return last & change_b, last & change_a

    def _illegal(self, m: Module) -> Value:
        """Detect that there is one illegal transition too many."""
        errors = Signal(range(self._errors + 2))
        with m.If(self.decode_error & (errors <= self._errors)):
            m.d.sync += errors.eq(errors + 1)
        with m.If(self.window.last):
            m.d.sync += errors.eq(0)
        return self.decode_error & (errors == self._errors)

    def _index(self, m: Module) -> Value:
        """Detect that from an index to the next in the same direction there was neither a turn nor the way back."""
        position = self.index_position
        backward, was_backward, known, checks, same = (Signal(name=f"index_{k}") for k in ("back", "was", *"kcs"))
        origin = Signal.like(position)
        way = Signal.like(position)
        m.d.sync += checks.eq(self.index_valid)
        since = known
        if self._presets:
            moved = Signal()  # in the clock of what is taken at the same time as `index_valid`
            m.d.sync += moved.eq(self.preset)
            since = known & ~moved
            m.d.sync += known.eq(since)
        with m.If(self.step[0]):
            m.d.sync += backward.eq(self.step[1])
        with m.If(self.index_valid):
            m.d.sync += [
                way.eq(position - (0 if self._index_reset else origin)),
                same.eq(since & (backward == was_backward)),
                was_backward.eq(backward),
                known.eq(1),
            ]
            if not self._index_reset:
                m.d.sync += origin.eq(position)
        off = Signal.like(position)
        m.d.comb += off.eq(way + Mux(was_backward, self._turn, -self._turn))
        wrong = checks & same & way.any() & off.any()
        with m.If(wrong):
            m.d.sync += self.index_error.eq(off)
        with m.If(self.clear):
            m.d.sync += self.index_error.eq(0)
        return wrong
