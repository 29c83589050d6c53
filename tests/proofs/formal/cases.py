"""Each proof is about some core: the table says which."""

from dataclasses import replace
from typing import Any
from unittest.mock import patch

from proofs.formal.angle import ANGLES
from proofs.formal.axes import COUNTS_OF_AXES, POSITIONS_OF_AXES
from proofs.formal.buses import ON_BUSES, RECORDS
from proofs.formal.control import CONTROL
from proofs.formal.outputs import OUTPUTS
from proofs.formal.probes import STANDSTILL_PROBES, counting, within
from proofs.formal.prove import Proof
from proofs.formal.reads import READS
from proofs.formal.timed import mt_after_upset, timed
from proofs.formal.tracking import COUNTS_OF_A_TICK

from tachometry.hdl.arithmetic.saturate import raised_for
from tachometry.spec import (
    Encoder,
    MTachometer,
    MTTachometer,
    RairanTachometer,
    Speed,
    STachometer,
    Timing,
    TTachometer,
)
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal as CarriedSpec
from tachometry.spec.language.units import signed_width


def core(
    tick_cycles: int, max_ticks: int = 4, max_count: int | None = None, decoding: int = 4, **options: Any
) -> STachometer:
    """Return a spec by its numbers: ticks of `tick_cycles` clocks, and speeds of at most `max_count` counts in each."""
    # One revolution a tick is as many counts as the encoder has, and one revolution a second a count a tick.
    return STachometer(
        encoder=Encoder(1, decoding),
        timing=Timing(decoding * tick_cycles, tick_cycles, max_ticks),
        max_speed=None if max_count is None else Speed.parse(f"{max_count}rev/s"),
        **options,
    )


_FRONT_PROBES = {"core_clocks": "conditioner.clocks_since_reset"}
_WINDOW_PROBES = {"core_left": "sampling_clock.left"}
_FILTER_PROBES = {
    "core_held_a": "conditioner.filter_a.held",
    "core_held_b": "conditioner.filter_b.held",
    "core_a": "conditioner.filter_a.filtered",
    "core_b": "conditioner.filter_b.filtered",
    "core_known_a": "conditioner.filter_a.known",
    "core_known_b": "conditioner.filter_b.known",
}
_METHOD_PROBES = {
    "core_m_s": "datapath.interval.m_s",
    "core_longest": "datapath.interval.longest",
    "core_opening": "datapath.interval.opening",
    "core_numerator": "datapath.interval.numerator",
    "core_alteration": "datapath.alteration.alteration",
    "core_offset": "datapath.alteration.offset",
    "core_rests": "datapath.interval.rests",
    "core_nearly": "datapath.interval.nearly",
}
_SERIAL_PROBES = {"core_known": "datapath.interval.known"}
_CARRIED_PROBES = {
    "core_carried": "datapath.quotient.reciprocal.carried",
    "core_q": "datapath.quotient.scaler_velocity.q",
    "core_r": "datapath.quotient.scaler_velocity.r",
    "core_less": "datapath.quotient.reciprocal.less",
    "core_carried_q": "datapath.quotient.reciprocal.carried_q",
}
_RECIPROCAL_PROBES = {wire: _METHOD_PROBES[wire] for wire in ("core_m_s", "core_longest")} | _CARRIED_PROBES


def _sum(spec: STachometer) -> tuple[dict[str, int], dict[str, str]]:
    """Return the sum of a window's steps: how it is kept, and where."""
    start = raised_for(spec.tick.longest, spec.tick.max_count)
    width = signed_width(spec.tick.longest + start)
    return {"START": start, "SUM_WIDTH": width}, {"core_sum": f"pulse_counter.{'raised' if start else 'count'}"}


def front(name: str, spec: STachometer) -> Proof:
    """Return P1, P2, P3, P6: the front end."""
    kept, probes = _sum(spec)
    parameters = kept | {
        "DECODING": spec.encoder.decoding,
        "FILTER": spec.filter_clocks,
        "T": spec.timing.tick_cycles,
        "TICK_LATENCY": spec.latency.tick,
        "MAX_COUNT": spec.tick.max_count,
        "COUNT_WIDTH": spec.widths.count,
        "POSITION_WIDTH": spec.position_width,
    }
    probes |= _FRONT_PROBES | within("glitch", _FILTER_PROBES, spec.filter_clocks > 0)
    probes |= within("window", _WINDOW_PROBES, spec.timing.tick_cycles > 1)
    return Proof(name, spec, "front", parameters, probes, depth=3 + spec.latency.tick)


def method(name: str, spec: STachometer, depth: int = 0, without: str = "", max_table: int | None = None) -> Proof:
    """Return P4, P5 and standstill: the S method, from ticks to updates."""
    with patch("tachometry.spec.methods.s.MAX_TABLE", max_table or 2048):
        latency, serial, used = spec.latency.tick_to_velocity, spec.latency.serial, spec.form.reciprocal
    carried = {}
    if isinstance(used, CarriedSpec):
        carried = {"CARRIED": used.depth, "C": used.scale}
    kept, probes = _sum(spec)
    parameters = kept | {
        "T": spec.timing.tick_cycles,
        "MAX_TICKS": spec.timing.max_ticks,
        "MAX_COUNT": spec.tick.max_count,
        "COUNT_WIDTH": spec.widths.count,
        "INTERVAL_WIDTH": spec.widths.interval,
        "NUMERATOR_WIDTH": spec.form.numerator_width,
        "FRAC_BITS": spec.velocity.frac_bits,
        "CANCEL": int(spec.cancel),
        "SERIAL": int(serial),
        "TICK_LATENCY": spec.latency.tick,
        "TICK_TO_VELOCITY": latency,
        "AGE": int(spec.age),
    }
    probes |= _METHOD_PROBES | within("window", _WINDOW_PROBES, spec.timing.tick_cycles > 1)
    probes |= within("aged", {"core_age": "age"}, spec.age)
    probes |= within("carried", _CARRIED_PROBES, bool(carried))
    probes |= within("serial", _SERIAL_PROBES, serial)
    return Proof(
        name, spec, "method", parameters | carried, probes, depth or latency + 2, without=without, max_table=max_table
    )


def m_method(name: str, spec: MTachometer) -> Proof:
    """Return the M method, from ticks to updates."""
    parameters = {
        "N": spec.average,
        "MAX_COUNT": spec.tick.max_count,
        "COUNT_WIDTH": spec.widths.count,
        "MAX_TICKS": spec.timing.max_ticks,
        "INTERVAL_WIDTH": spec.widths.interval,
        "BOUND_WIDTH": spec.velocity.bound_width,
        "FRAC_BITS": spec.velocity.frac_bits,
        "TICK_TO_VELOCITY": spec.latency.tick_to_velocity,
    }
    return Proof(
        name,
        spec,
        "m_method",
        parameters,
        STANDSTILL_PROBES,
        depth=max(spec.latency.tick_to_velocity + spec.average + 2, 3 * spec.average + 1),
    )


def reciprocal(name: str, spec: STachometer, max_table: int | None = None) -> Proof:
    """Return the carried reciprocal."""
    with patch("tachometry.spec.methods.s.MAX_TABLE", max_table or 2048):
        carried = spec.form.reciprocal
    assert isinstance(carried, CarriedSpec)
    parameters = {
        "MAX_TICKS": spec.timing.max_ticks,
        "INTERVAL_WIDTH": spec.widths.interval,
        "C": carried.scale,
        "CARRIED": carried.depth,
    }
    return Proof(name, spec, "reciprocal", parameters, _RECIPROCAL_PROBES, depth=2, max_table=max_table)


def small(**options: Any) -> STachometer:
    """Return a core whose whole S method is within reach of a SAT solver."""
    return core(**{"tick_cycles": 2, "max_count": 1, "frac_bits": 4, "position_width": 8} | options)


def small_m(average: int) -> MTachometer:
    """Return a core of the M method, a tick a clock, with bounds."""
    s = small(tick_cycles=1, bounds=True)
    return MTachometer(encoder=s.encoder, timing=s.timing, frac_bits=4, position_width=8, bounds=True, average=average)


_RAIRAN_PROBES = {
    "core_step": "step_late",
    "core_sum": "pulse_counter.count",
    "core_outside": "pulse_counter.left",
    "core_left": "datapath.counters.left",
    "core_more": "datapath.counters.c_more",
    "core_any": "datapath.counters.any",
    "core_dt": "datapath.counters.c_dt",
    "core_n": "datapath.counters.n",
    "core_high": "datapath.counters.high",
    "core_backward": "datapath.counters.backward",
    "core_moved": "datapath.counters.moved",
    "core_late": "datapath.counters.late",
    "core_in_step": "datapath.counters.in_step",
    "core_rest": "datapath.counters.rest",
    "core_beyond": "datapath.counters.beyond",
    "core_forced": "datapath.counters.forced",
    "core_at_rest": "datapath.counters.at_rest",
}


def rairan(name: str, tick_cycles: int, max_ticks: int, max_count: int) -> Proof:
    """Return PR: the method of Rairán, from steps to updates."""
    spec = RairanTachometer(**counting(tick_cycles, max_ticks, max_count))
    assert spec.tick.max_count == max_count, spec.tick.max_count
    parameters = {
        "T": tick_cycles,
        "MAX_TICKS": max_ticks,
        "MAX_COUNT": max_count,
        "COUNT_WIDTH": spec.widths.count,
        "VELOCITY_WIDTH": spec.velocity.width,
        "FRAC_BITS": spec.velocity.frac_bits,
    }
    return Proof(name, spec, "rairan", parameters, _RAIRAN_PROBES | STANDSTILL_PROBES, depth=10)


def after_upset(name: str, proof: Proof, lemmas: str, without: str = "") -> Proof:
    """Return from any state of the flip-flops the properties hold again, and the `lemmas` on what the checker takes
    from the core.

    Neither core nor checker is reset, so what holds in one clock after any state holds in all that follow.
    """
    parameters = proof.parameters | ({} if proof.checker == "m_method" else {"UPSET": 1})
    clocks = proof.spec.recovery.clocks
    assert clocks is not None
    return replace(
        proof, name=name, parameters=parameters, depth=1, recovers=clocks, only=f"p* {lemmas}", without=without
    )


# Small cores, one at least of every checker: what CI proves.
QUICK = [
    "x4, 2 clocks",
    "x2, 7 clocks",
    "eq. (21), 1 clock",
    "M of 4",
    "6 ticks",
    "Rairán",
    "T",
    "M/T",
    "T in ticks",
    "counts of a tick",
    "four axes",
    "positions of two axes",
    "wishbone",
    "axi-lite",
    "stream",
    "read",
    "read amt22",
    "read tformat",
    "control loop",
    "control loop, any gains",
    "outputs",
    "2 pole pairs of 5 counts",
]

PROOFS = [
    front("x4, 15 clocks", core(15, max_count=7)),
    front("x4, filter 3", core(15, max_count=6, filter_clocks=3)),
    front("x4, 2 clocks", core(2)),
    front("x4, 1 clock", core(1)),
    front("x2, 7 clocks", core(7, max_count=2, decoding=2)),
    front("x1, filter 1", core(7, max_count=2, decoding=1, filter_clocks=1)),
    method("eq. (17)", small(cancel=False)),
    method("eq. (21), 5 ticks", small(max_ticks=5)),
    method("eq. (21), 1 clock", small(tick_cycles=1)),
    method("eq. (21), 16 ticks", small(tick_cycles=1, max_ticks=16)),
    method("age", small(age=True), depth=14),
    method("age, 1 clock", small(tick_cycles=1, age=True, max_ticks=5)),
    m_method("M", small_m(1)),
    m_method("M of 4", small_m(4)),
    m_method("M of 3", small_m(3)),
    method("table", small(tick_cycles=7), depth=14),
    method("sums", core(12, 8, max_count=7), depth=10, without="p4_* p5_velocity p7_* lemma_since"),
    method(
        "sums of eq. (17)",
        core(12, 8, max_count=7, cancel=False),
        depth=10,
        without="p4_* p5_velocity p7_* lemma_since",
    ),
    method("carried", small(max_ticks=16)),
    reciprocal("2049 ticks", core(5, 2049, max_count=1)),
    reciprocal("6 ticks", small(max_ticks=6), max_table=4),
    rairan("Rairán", 3, 4, 2),
    timed("T", TTachometer, 2, 1),
    timed("M/T", MTTachometer, 2, 1),
    timed("T of few digits", TTachometer, 4, 1),
    timed("M/T of few digits", MTTachometer, 4, 1, min_time=15),
    replace(timed("M/T of whole cycles", MTTachometer, 2, 1, whole_cycles=True), depth=8),
    timed("T in ticks", TTachometer, 2, 2, 12, timer="tick"),
    timed("M/T in ticks", MTTachometer, 2, 2, timer="tick"),
    after_upset(
        "upset, x4, filter 3", front("", core(3, filter_clocks=3)), "lemma_held lemma_window", "p1_* p2_* p6_quiet"
    ),
    after_upset("upset, eq. (21)", method("", small(tick_cycles=1)), "lemma_core"),
    after_upset("upset, carried", method("", small(tick_cycles=1, max_ticks=5), max_table=4), "lemma_core"),
    after_upset("upset, M of 4", m_method("", small_m(4)), "lemma_bounded"),
    after_upset("upset, Rairán", rairan("", 2, 3, 2), "lemma_flags lemma_left", "pr_standstill"),
    after_upset("upset, T", timed("", TTachometer, 2, 1), "lemma_timer"),
    *mt_after_upset("upset, M/T", timed("", MTTachometer, 2, 1)),
    *COUNTS_OF_A_TICK,
    *COUNTS_OF_AXES,
    *POSITIONS_OF_AXES,
    *ON_BUSES,
    RECORDS,
    *READS,
    *CONTROL,
    *OUTPUTS,
    *ANGLES,
]
