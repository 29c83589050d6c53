"""These proofs are about the counters of many axes."""

from functools import partial

from amaranth import Module, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from proofs.formal.prove import Proof

from tachometry.hdl.axes import axes_datapath, axis_counters, rounds
from tachometry.spec import AxesSpec, Encoder, Speed, STachometer, Timing

_SPEC = STachometer(encoder=Encoder(1))
_SAME = ("slot", "first", "last", "ready")


class Counted(wiring.Component):
    """Rounds and counters: from the levels of all axes to their counts."""

    def __init__(self, axes: int, slots: int, n_rounds: int) -> None:
        # By the names in their modules, where a mutant takes their place.
        self.rounds = rounds.Rounds(slots, n_rounds, 3)
        self.counters = axis_counters.AxisCounters(slots=slots, rounds=n_rounds, decoding=4)
        super().__init__(
            {
                "level_a": In(axes),
                "level_b": In(axes),
                "axis": Out(range(slots)),
                "step": Out(signed(2)),
                "decode_error": Out(1),
                "complete": Out(1),
                "count": Out(self.counters.count.shape()),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.rounds = self.rounds
        m.submodules.counters = counters = self.counters
        m.d.comb += [
            *(getattr(counters, name).eq(getattr(self.rounds, name)) for name in _SAME),
            counters.level_a.eq(axis_counters.of_slot(self.level_a, self.rounds.slot)),
            counters.level_b.eq(axis_counters.of_slot(self.level_b, self.rounds.slot)),
            *(
                getattr(self, name).eq(getattr(counters, name))
                for name in ("axis", "step", "decode_error", "complete", "count")
            ),
        ]
        return m


def _counts(name: str, axes: int, slots: int, n_rounds: int) -> Proof:
    """Return PX: every step of an axis is in its own sum, and in no other."""
    parameters = {"AXES": axes, "SLOTS": slots, "ROUNDS": n_rounds, "COUNT_WIDTH": n_rounds.bit_length() + 1}
    probes = {
        "core_slot": "rounds.slot",
        "core_warmed": "rounds.warmed",
        "core_first": "rounds.first",
        "core_last": "rounds.last",
    }
    made = partial(Counted, axes, slots, n_rounds)
    # In two rounds all that is in memory has been written and seen, and in those of a tick its last one has come.
    return Proof(name, _SPEC, "axes", parameters, probes, depth=max(2, n_rounds + 1) * slots + 4, box=made)


def _positions(name: str, axes: int, tick_cycles: int) -> Proof:
    """Return PX: every count that is handed over is in the position of its axis at its tick, and in no other."""
    timing = Timing(4 * tick_cycles, tick_cycles, 2)
    speed = Speed.parse("1rev/s")
    alone = STachometer(encoder=Encoder(1), timing=timing, max_speed=speed, position_width=8, frac_bits=4)
    spec = AxesSpec(tachometer=alone, axes=axes)
    parameters = {
        "AXES": axes,
        "SLOTS": spec.slots,
        "T": tick_cycles,
        "TURN": spec.turn_cycles,
        "MAX_COUNT": spec.axis.tick.max_count,
        "COUNT_WIDTH": spec.rounds.bit_length() + 1,
        "PULSE_WIDTH": spec.axis.widths.count,
        "POSITION_WIDTH": spec.axis.position_width,
        "AXIS_WIDTH": len(axes_datapath.AxesDatapath(spec).axis),
    }
    probes = {f"core_{name}": f"turns.{name}" for name in ("step", "axis", "clears")}
    made = partial(lambda: axes_datapath.AxesDatapath(spec))
    # In a tick and a turn all that is in memory has been written and shown.
    depth = tick_cycles + spec.turn_cycles + 6
    return Proof(name, _SPEC, "axes_positions", parameters, probes, depth, box=made)


POSITIONS_OF_AXES = [_positions("positions of two axes", 2, 20)]
COUNTS_OF_AXES = [
    _counts("four axes", 4, 4, 1),
    _counts("two axes of four slots", 2, 4, 3),
    _counts("three axes of five slots", 3, 5, 2),
]
