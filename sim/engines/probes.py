"""What a waveform shows of a core."""

from typing import Any

from amaranth import Cat, Module, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl import Tachometer
from tachometry.spec import TachometerSpec

WORD = 32  # bits


def shown(core: Tachometer) -> dict[str, Value]:
    """Signals of the waveform, in the order in which they are shown."""
    inner = {"m_e": core.pulse_count, **core.datapath.probes}
    order = (
        *("a", "b", "z", "tick_in", "decode_error", "tick", "tick_error", *inner, "overflow", "velocity_valid"),
        *("velocity", "velocity_overflow", "interval", "forced", "stalled", "index_valid", "index_position"),
        *("position", "swallowed_edges"),
    )
    ports = {port.name for port in core.spec.ports}
    return {name: inner[name] if name in inner else getattr(core, name) for name in order if name in ports | {*inner}}


class Watched(wiring.Component):
    """A core whose shown signals are outputs.

    Parameters
    ----------
    spec : TachometerSpec

    Members
    -------
    The ports of the core, and `shown_0`, `shown_1` … of 32 bits, out: the shown signals, the first in the lowest bits.
    """

    def __init__(self, spec: TachometerSpec) -> None:
        self.core = Tachometer(spec)
        self.widths = {name: (len(value), value.shape().signed) for name, value in shown(self.core).items()}
        flow = {"input": In, "output": Out}
        members: dict[str, Any] = {
            port.name: flow[port.direction](signed(port.width) if port.signed else port.width)
            for port in spec.ports
            if port.name not in ("clk", "rst")
        }
        self.n_words = -(-sum(width for width, _ in self.widths.values()) // WORD)
        super().__init__(members | {f"shown_{k}": Out(WORD) for k in range(self.n_words)})
        self._flows = {name: member.flow for name, member in members.items()}

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.core = core = self.core
        for name, flow in self._flows.items():
            inside, outside = getattr(core, name), getattr(self, name)
            m.d.comb += inside.eq(outside) if flow == In else outside.eq(inside)
        words = Cat(getattr(self, f"shown_{k}") for k in range(self.n_words))
        m.d.comb += words.eq(Cat(shown(core).values()))
        return m
