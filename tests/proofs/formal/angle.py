"""These proofs are about the electrical angle: its exact count, and the steps of what is shown."""

from fractions import Fraction

from proofs.formal.outputs import Boxes
from proofs.formal.prove import Proof

from tachometry.hdl.extras import electrical
from tachometry.spec import Encoder, STachometer
from tachometry.spec.core.extras.electrical import ElectricalAngle
from tachometry.spec.formats.angles import Angles

_TICK, _LATENCY = 64, 2
_ANGLES = {
    (counts, pole_pairs): Angles(counts, pole_pairs, _TICK, 8, 8, 9, 0, 0, Fraction(0))
    for counts, pole_pairs in ((96, 7), (5, 2), (73, 31))
}
_NAMES = ("sum_", "rest", "phase", "debt", "grows", "place", "room", "ahead", "moved")


def _angle(counts: int, pole_pairs: int) -> Proof:
    angles = _ANGLES[counts, pole_pairs]

    def box() -> Boxes:
        inputs = {"native_velocity": 8}
        extra = ElectricalAngle(pole_pairs=pole_pairs)
        return Boxes({"counted": electrical.Gates(extra, angles, _LATENCY, inputs, corrects=False)})

    parameters = {"COUNTS": counts, "POLE_PAIRS": pole_pairs}
    parameters |= {"REST": (counts - 1).bit_length(), "HALF": (angles.count[0] >> 1).bit_length()}
    probes = {f"core_{name}": f"counted.{name}" for name in _NAMES}
    name = f"{pole_pairs} pole pairs of {counts} counts"
    return Proof(name, STachometer(encoder=Encoder(1)), "angle", parameters, probes, 4, box=box)


ANGLES = [_angle(*numbers) for numbers in _ANGLES]
