"""From asynchronous pins to levels of the clock domain."""

from collections.abc import Mapping
from types import MappingProxyType

from amaranth import Cat, Module, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, idle_of
from tachometry.hdl.front_end.blanking import Blanking
from tachometry.hdl.front_end.glitch_filter import GlitchFilter
from tachometry.hdl.wires.ports import Box, by_name
from tachometry.hdl.wires.synchronizer import Synchronizer


class InputConditioner(Box):
    """Brings the encoder's lines into the clock domain, and keeps glitches out of it.

    Latency: a level that is sampled at clock edge c is at the output in clock c + 2 + `filter_clocks`.

    - `complemented`: Lines that come with their complements.
    - `blanked`: Boxes behind the filters of lines whose echoes are ignored.
    """

    def __init__(
        self,
        filter_clocks: int = 0,
        lines: tuple[str, ...] = ("a", "b"),
        complemented: tuple[str, ...] = (),
        blanked: Mapping[str, Blanking] = MappingProxyType({}),
    ) -> None:
        self._filter_clocks, self._lines, self._complemented = filter_clocks, lines, complemented
        self._blanked = blanked
        super().__init__(
            **{name: In(1) for name in lines},  # asynchronous pins
            **{f"level_{name}": Out(1) for name in lines},  # synchronised and filtered
            # From the first clock on in which the level of this line before the present one is real as well.
            **{f"ready_{name}": Out(1) for name in lines},
            **{f"{name}_n": In(1) for name in complemented},
            # The line and its complement are real and equal, filtered neither, two clocks after the pins.
            **{f"equal_{name}": Out(1) for name in complemented},
            clear=In(1),  # `filtered_edges` is 0 in the next clock
            filtered_edges=Out(16),  # edges that the filter has kept out, two for each glitch; stays at 65534
        )
        self._filters = {name: GlitchFilter(filter_clocks) for name in lines if filter_clocks}

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Counters of the filters and of the blanking, which a simulation may move on."""
        blanked = {f"blanking_{name}": box for name, box in self._blanked.items()}
        return idle_of({f"filter_{name}": box for name, box in self._filters.items()} | blanked)

    def build(self, m: Module) -> None:
        # Two clocks for the synchroniser, one for the decoder's memory of the level before.
        clocks_since_reset = Signal(3)
        m.d.sync += clocks_since_reset.eq((clocks_since_reset << 1) | 1)
        swallowed = []
        levels, readies = (by_name(self, self._lines, form) for form in ("level_{}", "ready_{}"))
        complements, equals = (by_name(self, self._complemented, form) for form in ("{}_n", "equal_{}"))
        levels |= {name: _blank(m, name, box, levels[name], readies[name]) for name, box in self._blanked.items()}
        for name, pin in by_name(self, self._lines).items():
            level = Signal(name=f"synchronised_{name}") if self._filter_clocks else levels[name]
            m.submodules[f"sync_{name}"] = Synchronizer(pin, level)
            if name in complements:
                other = Signal(name=f"synchronised_{name}_n")
                m.submodules[f"sync_{name}_n"] = Synchronizer(complements[name], other)
                m.d.comb += equals[name].eq(clocks_since_reset[1] & (level == other))
            if self._filter_clocks:
                m.submodules[f"filter_{name}"] = line = self._filters[name]
                m.d.comb += [line.level.eq(level), line.valid.eq(clocks_since_reset[1]), levels[name].eq(line.filtered)]
                m.d.sync += readies[name].eq(line.known)
                swallowed.append(line.swallowed)
            else:
                m.d.comb += readies[name].eq(clocks_since_reset[-1])
        if self._filter_clocks:
            glitches = Signal(15)
            sum_ = Signal(16)
            m.d.comb += [sum_.eq(glitches + sum(swallowed)), self.filtered_edges.eq(Cat(0, glitches))]
            m.d.sync += glitches.eq(sum_)
            with m.If(sum_[-1]):
                m.d.sync += glitches.eq(0x7FFF)
            with m.If(self.clear):
                m.d.sync += glitches.eq(0)


def _blank(m: Module, name: str, box: Blanking, level: Signal, ready: Signal) -> Signal:
    """Drive the level of a line from its box, and return the level that the box takes."""
    m.submodules[f"blanking_{name}"] = box
    m.d.comb += [level.eq(box.held), box.ready.eq(ready)]
    taken: Signal = box.level
    return taken
