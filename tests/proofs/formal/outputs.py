"""These proofs are about what follows position and velocity, and what watches lines: a box each, side by side."""

from collections.abc import Mapping
from fractions import Fraction

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In
from proofs.formal.prove import Proof

from tachometry.hdl.extras import health, over_speed, position_compare, probe
from tachometry.hdl.front_end import index_capture, modulo_counter, open_circuit, position_counter
from tachometry.spec import Encoder, STachometer
from tachometry.spec.core.extras.position_compare import Compare

OPEN, MODULUS, LIMIT, PULSE, APART = 3, 5, 5, 2, 3
PARTED, PARTS = 16, 3  # counts of a revolution, and its parts
_WIDTH = 4  # of positions
_PROBES = {
    "core_awaited": "compare.awaited",
    "core_armed": "home.armed",
    "core_since": "probe.since",
    "core_number": "both.number",
    "core_next": "both.awaited",
    "core_rest": "parted.rest",
}


class Boxes(wiring.Component):
    """Has boxes that share nothing; a port has the name of its box in front.

    - `boxes`: By the names in their modules, where a mutant takes its place.
    """

    def __init__(self, boxes: Mapping[str, wiring.Component]) -> None:
        self._boxes = boxes
        super().__init__(
            {
                f"{name}_{port}": flow
                for name, box in self._boxes.items()
                for port, flow in box.signature.members.items()
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        for name, box in self._boxes.items():
            m.submodules[name] = box
            for port, member in box.signature.members.items():
                inner, outer = getattr(box, port), getattr(self, f"{name}_{port}")
                m.d.comb += inner.eq(outer) if member.flow == In else outer.eq(inner)
        return m


def _boxes() -> Boxes:
    return Boxes(
        {
            "modulo": modulo_counter.ModuloCounter(MODULUS),
            "parted": modulo_counter.ModuloCounter(Fraction(PARTED, PARTS)),
            "position": position_counter.PositionCounter(_WIDTH, preset=0),
            "home": index_capture.IndexCapture(_WIDTH, once=True),
            "probe": probe.Gates((1,), _WIDTH, 3),
            "trip": over_speed.Gates(LIMIT, _WIDTH),
            "open": open_circuit.OpenCircuit(OPEN),
            "watch": health.Gates(second=6, edges=2, errors=1),
            "compare": position_compare.Gates(Compare(1, APART, 2, "2clk"), PULSE, _WIDTH),
            "both": position_compare.Gates(Compare(1, APART, 2, "2clk", "both"), PULSE, _WIDTH, aims=True),
        }
    )


def _outputs(name: str, recovers: int = 0) -> Proof:
    """Return PO; from any state, once what an upset has changed is cleared, armed, set, or taken anew."""
    parameters = {"OPEN": OPEN, "MODULUS": MODULUS, "LIMIT": LIMIT, "APART": APART, "UPSET": int(recovers > 0)}
    parameters |= {"PARTED": PARTED, "PARTS": PARTS}
    spec = STachometer(encoder=Encoder(1))
    depth = 1 if recovers else OPEN + 4
    return Proof(name, spec, "outputs", parameters, _PROBES, depth, box=_boxes, recovers=recovers)


OUTPUTS = [_outputs("outputs"), _outputs("upset, outputs", recovers=10)]
