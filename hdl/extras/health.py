"""Gates of `spec.core.extras.health`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from amaranth import C, Cat, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from tachometry.hdl.arithmetic.idle import Idle, idle_of
from tachometry.hdl.front_end.open_circuit import OpenCircuit
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.wires.ports import Box, by_name
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.health import (
    FAULT_WIDTH,
    FAULTS_WIDTH,
    OPEN,
    READ_COUNT_WIDTH,
    READ_COUNTS,
    READ_FAULT_WIDTH,
    READ_FAULTS,
    Fault,
    Health,
)
from tachometry.spec.core.reads import READ_FAULT_BITS


def _keep(m: Module, box: "Gates | ReadGates", code: Value) -> None:
    """Keep the first fault, and count them all, until a program clears them."""
    m.d.comb += box.fault.eq(box.health.any())
    with m.If(box.seen):
        with m.If(box.health == 0):
            m.d.sync += box.health.eq(code)
        with m.If(~box.faults.all()):
            m.d.sync += box.faults.eq(box.faults + 1)
    with m.If(box.clear):
        m.d.sync += [box.health.eq(0), box.faults.eq(0)]


class ReadGates(Box):
    """Faults of an encoder that is read: `read_fault` has one in each clock in which it is not 0, see `Gates`."""

    def __init__(self, counts: Sequence[str]) -> None:
        self._counts = counts
        outputs = {"seen": Out(1), "health": Out(READ_FAULT_WIDTH), "faults": Out(FAULTS_WIDTH), "fault": Out(1)}
        outputs |= dict.fromkeys(counts, Out(READ_COUNT_WIDTH))
        super().__init__({"read_fault": In(READ_FAULT_BITS), "clear": In(1), **outputs})

    def build(self, m: Module) -> None:
        m.d.comb += self.seen.eq(self.read_fault.any())
        _keep(m, self, self.read_fault + READ_FAULTS)
        for name, count in by_name(self, self._counts).items():
            with m.If(self.read_fault.matches(*READ_COUNTS[name]) & ~count.all()):
                m.d.sync += count.eq(count + 1)
            with m.If(self.clear):
                m.d.sync += count.eq(0)


@dataclass(frozen=True)
class Turn:
    """A turn from index to index."""

    counts: int
    position_width: int  # bits
    resets: bool = False  # the index sets the position to 0
    presets: bool = False  # an input sets the position


class Gates(Box):
    """A fault in clock c makes `seen` high in clock c, and is at the outputs in clock c + 1, until `clear`.

    Counts that are wrong between two indices are seen in the clock after `index_valid`. Edges and errors are counted
    for a second, then anew. A turn in which the position is preset is not checked.

    - `edges`: Edges of a line without one of the other that are a fault of the other.
    - `errors`: The greatest number of illegal transitions that is no fault.
    - `turn`: None: there is no index, or no number of counts between two.
    - `complements`: Lines that come with their complements, and for how many clocks a line may equal it.
    - `misses`: The index is taken in a state, which it may miss.
    """

    def __init__(
        self,
        second: int,
        edges: int,
        errors: int,
        turn: Turn | None = None,
        complements: Mapping[str, int] = MappingProxyType({}),
        misses: bool = False,
    ) -> None:
        self._edges, self._errors, self._turn, self._misses = edges, errors, turn, misses
        self.window = SamplingClock(second)
        self.open = {line: OpenCircuit(clocks) for line, clocks in complements.items()}
        index: dict[str, Member] = {}
        if turn is not None:
            position = signed(turn.position_width)
            index = {"index_valid": In(1), "index_position": In(position), "index_error": Out(position)}
            index |= {"preset_rises": In(1)} if turn.presets else {}
        super().__init__(
            **dict.fromkeys(("level_a", "level_b", "ready", "decode_error", "clear"), In(1)),
            **{f"equal_{line}": In(1) for line in complements},
            step=In(signed(2)),
            **index,
            **({"index_missed": In(1)} if misses else {}),
            seen=Out(1),
            health=Out(FAULT_WIDTH),
            faults=Out(FAULTS_WIDTH),
            fault=Out(1),
        )

    @classmethod
    def of(cls, extra: Health, spec: TachometerSpec) -> "Gates | ReadGates":
        if spec.encoder.sampled is not None:
            return ReadGates(extra.read_counts(spec))
        front, turn = spec.front_end, None
        if front.index_watched:
            presets = spec.preset is not None
            turn = Turn(spec.encoder.encoder_counts, spec.position_width, front.index_resets, presets)
        complements = {pin.of: pin.holds for pin in extra.pins(spec)}
        misses = front.index_state is not None
        return cls(spec.timing.clock_hz, extra.edges, extra.errors, turn, complements, misses)

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The times within a second and of equal lines, which a simulation may move on."""
        return idle_of({"window": self.window} | {f"open_{line}": box for line, box in self.open.items()})

    def build(self, m: Module) -> None:
        m.submodules.window = self.window
        a_stands, b_stands = self._standing(m)
        seen = {Fault.A_STANDS: a_stands, Fault.B_STANDS: b_stands, Fault.ILLEGAL: self._illegal(m)}
        if self._turn is not None:
            seen[Fault.INDEX_COUNTS] = self._index(m, self._turn)
        for line, box in self.open.items():
            m.submodules[f"open_{line}"] = box
            m.d.comb += [box.equal.eq(getattr(self, f"equal_{line}")), box.clear.eq(self.clear)]
            seen[OPEN[line]] = box.open
        if self._misses:
            seen[Fault.INDEX_MISSED] = self.index_missed
        code: Value = Value.cast(0)
        for fault in sorted(seen, reverse=True):
            code = Mux(seen[fault], C(fault, FAULT_WIDTH), code)
        m.d.comb += self.seen.eq(Cat(seen.values()).any())
        _keep(m, self, code)

    def _standing(self, m: Module) -> tuple[Value, Value]:
        """Return whether A stands, and whether B stands: the other line has had the edges of a fault alone."""
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
        """Return whether there is one illegal transition too many."""
        errors = Signal(range(self._errors + 2))
        with m.If(self.decode_error & (errors <= self._errors)):
            m.d.sync += errors.eq(errors + 1)
        with m.If(self.window.last):
            m.d.sync += errors.eq(0)
        return self.decode_error & (errors == self._errors)

    def _index(self, m: Module, turn: Turn) -> Value:
        """Return whether from one index to the next in the same direction there was neither a turn nor the way back."""
        position = self.index_position
        backward, was_backward, known, checks, same = (Signal(name=f"index_{k}") for k in ("back", "was", *"kcs"))
        origin = Signal.like(position)
        way = Signal.like(position)
        m.d.sync += checks.eq(self.index_valid)
        since = known
        if turn.presets:
            moved = Signal()  # in the clock of what is taken at the same time as `index_valid`
            m.d.sync += moved.eq(self.preset_rises)
            since = known & ~moved
            m.d.sync += known.eq(since)
        with m.If(self.step[0]):
            m.d.sync += backward.eq(self.step[1])
        with m.If(self.index_valid):
            m.d.sync += [
                way.eq(position - (0 if turn.resets else origin)),
                same.eq(since & (backward == was_backward)),
                was_backward.eq(backward),
                known.eq(1),
            ]
            if not turn.resets:
                m.d.sync += origin.eq(position)
        off = Signal.like(position)
        m.d.comb += off.eq(way + Mux(was_backward, turn.counts, -turn.counts))
        wrong = checks & same & way.any() & off.any()
        with m.If(wrong):
            m.d.sync += self.index_error.eq(off)
        with m.If(self.clear):
            m.d.sync += self.index_error.eq(0)
        return wrong
