"""Says which signals of a core a waveform shows."""

from amaranth import Cat, Module, Value
from amaranth.lib.wiring import Out

from tachometry.hdl import AnyTachometer, core_of
from tachometry.hdl.wires.ports import Box, hand_through, members
from tachometry.spec import CoreSpec
from tachometry.spec.language.port import INDEX, TICK, UPDATE

WORD = 32  # bits
_ORDER = {TICK: 1, UPDATE: 2, INDEX: 3}  # of strobes in the waveform; errors come first


def shown(core: AnyTachometer) -> dict[str, Value]:
    """Return signals of the waveform, in the order in which they are shown.

    First the pins, then every strobe with the ports that are new with it; the inside of the datapath stands before the
    update that comes of it.
    """
    spec = core.spec
    found: dict[str, Value] = {pin.name: getattr(core, pin.name) for pin in spec.ports.pins}
    for strobe, held in sorted(spec.ports.strobes.items(), key=lambda item: _ORDER.get(item[0], 0)):
        if strobe == UPDATE:
            inner = core.datapath.probes
            assert not inner.keys() & {port.name for port in spec.ports}, "a probe must not have the name of a port"
            found |= inner
        found |= {name: getattr(core, name) for name in (strobe, *held)}
    return found


class Watched(Box):
    """Wraps a core, so that the signals to be shown are outputs.

    Members are the ports of the core, and `shown_0`, `shown_1` … of 32 bits, with the first signal in the lowest bits.
    """

    def __init__(self, spec: CoreSpec) -> None:
        self.core = core_of(spec)
        self.widths = {name: (len(value), value.shape().signed) for name, value in shown(self.core).items()}
        self.n_words = -(-sum(width for width, _ in self.widths.values()) // WORD)
        self._ports = members(spec.ports)
        super().__init__(self._ports | {f"shown_{k}": Out(WORD) for k in range(self.n_words)})

    def build(self, m: Module) -> None:
        m.submodules.core = core = self.core
        hand_through(m, self, core, self._ports)
        words = Cat(getattr(self, f"shown_{k}") for k in range(self.n_words))
        m.d.comb += words.eq(Cat(shown(core).values()))
