"""These proofs are about the T and the M/T method."""

from dataclasses import replace
from typing import Any

from proofs.formal.probes import STANDSTILL_PROBES, counting, within
from proofs.formal.prove import Proof

from tachometry.hdl.methods.quotient_velocity import QuotientVelocity
from tachometry.spec import MTTachometer, TTachometer
from tachometry.spec.language.units import signed_width

_TIMED_PROBES = {
    "core_step": "decoder.step",
    "core_age": "datapath.gap_timer.age",
    "core_opened": "datapath.gap_timer.opened",
    "core_ticked": "datapath.gap_timer.tick",
    "core_count": "datapath.gap_timer.count",
    "core_overdue": "datapath.gap_timer.overdue",
    "core_ends": "datapath.quotient_velocity.ends",
    "core_decays": "datapath.quotient_velocity.decays",
    "core_start": "datapath.quotient_velocity.start",
    "core_measuring": "datapath.quotient_velocity.measuring",
    "core_done": "datapath.quotient_velocity.divider.done",
    "core_forced": "datapath.quotient_velocity.forced",
    "core_copy": "datapath.quotient_velocity.copy",
    "core_nearer": "datapath.quotient_velocity.nearer",
    "core_passes": "datapath.quotient_velocity.farther",
    "core_running": "datapath.quotient_velocity.divider.running",
    "core_remainder": "datapath.quotient_velocity.divider.remainder",
    "core_digits": "datapath.quotient_velocity.divider.digits",
    "core_steps": "datapath.quotient_velocity.divider.left",
    "core_by": "datapath.quotient_velocity.divider.by",
}
_CLOCKED_PROBES = {
    "core_came": "datapath.gap_timer.earlier",
    "core_nearly": "datapath.gap_timer.nearly",
    "core_way": "datapath.count_way.way",
}
_WINDOW_OF_MT_PROBES = {
    "core_length": "datapath.length",
    "core_still": "datapath.still",
    "core_late": "datapath.late",
    "core_travelled": "datapath.travelled",
}
_CYCLES_OF_MT_PROBES = {
    "core_counted": "datapath.counted",
    "core_cycled": "datapath.cycled",
    "core_waived": "datapath.waived",
}


def timed(
    name: str,
    method: type[TTachometer | MTTachometer],
    tick_cycles: int,
    max_count: int,
    max_ticks: int = 4,
    **options: Any,
) -> Proof:
    """Return PT: the T and the M/T method, from steps and ticks to updates."""
    spec = method(**counting(tick_cycles, max_ticks, max_count), **options)
    assert spec.tick.max_count == max_count, spec.tick.max_count
    mt = isinstance(spec, MTTachometer)
    parameters = {
        "MT": int(mt),
        "LATTICE": int(spec.form.on_lattice),
        "T": tick_cycles,
        "COUNT_WIDTH": spec.widths.count,
        "MAX_COUNT": max_count,
        "MAX_VELOCITY": spec.velocity.max,
        "VELOCITY_WIDTH": spec.velocity.width,
        "MAX_TICKS": max_ticks,
        "MAX_PERIODS": spec.form.max_periods,
        "MIN_PERIODS": spec.form.min_periods if isinstance(spec, MTTachometer) else 0,
        "CYCLE": spec.form.cycle_counts if isinstance(spec, MTTachometer) else 1,
        "MAX_QUOTIENT": spec.form.max_quotient,
        "SATURATES": int(spec.form.saturates),
        "FLAGS": int(spec.form.flags_range),
        "INTEGER_BITS": spec.form.max_quotient.bit_length() + 1,
        "QUOTIENT_BITS": spec.form.quotient_bits,
        "DIVIDEND_DIGITS": QuotientVelocity(spec).divider.dividend_digits,
        "TRAVELLED_WIDTH": signed_width(spec.form.most_travelled) if isinstance(spec, MTTachometer) else 1,
        "INTERVAL_WIDTH": spec.widths.interval,
        "FRAC_BITS": spec.velocity.frac_bits,
        "DIVISION_CLOCKS": spec.form.division_clocks,
    }
    probes = _TIMED_PROBES | STANDSTILL_PROBES | within("mt", _WINDOW_OF_MT_PROBES, mt)
    probes |= within("cycles", _CYCLES_OF_MT_PROBES, parameters["CYCLE"] > 1)
    probes |= within("clocked", _CLOCKED_PROBES, not spec.form.on_lattice)
    lattice = {"core_window": "sampling_clock.left", "core_last": "datapath.gap_timer.last"}
    probes |= within("lattice", lattice, spec.form.on_lattice)
    probes["core_negative"] = "datapath.was_negative" if spec.form.on_lattice else "datapath.count_way.negative"
    probes |= within("flagged", {"out_of_range": "out_of_range"}, spec.form.flags_range)
    held = {"core_back": "negative", "core_most": "most"}
    probes |= within(
        "holds", {name: f"datapath.quotient_velocity.{at}" for name, at in held.items()}, spec.form.saturates
    )
    probes |= within("flag", {"core_beyond": "datapath.quotient_velocity.beyond"}, spec.form.flags_range)
    return Proof(name, spec, "timed", parameters, probes, depth=4)


# What can be said of M/T without what is divided; "travelled" takes as long as all the others.
_MT_GIVEN = {
    "given": "lemma_idle lemma_age lemma_timer lemma_starts lemma_nearly lemma_came lemma_way lemma_since lemma_free "
    "lemma_running lemma_silent lemma_many lemma_steps lemma_rest lemma_rests lemma_rested lemma_size lemma_length "
    "lemma_unopened lemma_core_length lemma_window_free pt_update pt_held pt_spacing pt_rest",
    "travelled": "lemma_travelled",
}
_CYCLES_GIVEN = {"cycles": "lemma_waived lemma_counted lemma_one_way"}


def mt_after_upset(name: str, proof: Proof) -> list[Proof]:
    """Return the same in parts, as quotients so far from the upset are beyond the solver.

    From any state that is given which holds some clocks before the end; at the end what is shown is of a division that
    began since then; and what such a division shows is right, by induction.
    """
    spec, clocks = proof.spec, proof.spec.recovery.clocks
    assert isinstance(spec, MTTachometer)
    assert clocks is not None
    settled = clocks - spec.form.max_periods - spec.form.max_interval - spec.form.division_clocks - 1
    upset = replace(proof, parameters=proof.parameters | {"UPSET": 1, "SETTLED": 0})
    late = upset.parameters | {"SETTLED": settled}
    parts = _MT_GIVEN | (_CYCLES_GIVEN if spec.form.cycle_counts > 1 else {})
    return [
        *(
            replace(upset, name=f"{name}: {part}", depth=1, recovers=settled, only=given)
            for part, given in parts.items()
        ),
        replace(upset, name=f"{name}: since", parameters=late, depth=1, recovers=clocks, only="lemma_fresh"),
        replace(upset, name=name, given=" ".join(parts.values()), without="lemma_fresh"),
    ]
