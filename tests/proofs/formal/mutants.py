"""Each proof must refute mutants, listed here."""

from dataclasses import dataclass
from typing import Any

from tachometry.hdl.arithmetic.carried_reciprocal import CarriedReciprocal
from tachometry.hdl.arithmetic.divider import Divider
from tachometry.hdl.arithmetic.remainder_scaler import RemainderScaler
from tachometry.hdl.arithmetic.saturate import saturate_raised
from tachometry.hdl.arithmetic.scaler import PipelinedScaler, SerialScaler
from tachometry.hdl.axes.axes_datapath import AxesDatapath
from tachometry.hdl.axes.axis_counters import AxisCounters
from tachometry.hdl.axes.rounds import Rounds
from tachometry.hdl.axes.turns import Turns
from tachometry.hdl.bus.axi_lite import AxiLiteBridge
from tachometry.hdl.bus.bank import RegisterBank
from tachometry.hdl.bus.tick_position import TickPosition
from tachometry.hdl.bus.wishbone import WishboneBridge
from tachometry.hdl.control.controller import Controller
from tachometry.hdl.control.update_window import UpdateWindow
from tachometry.hdl.front_end.conditioner import InputConditioner
from tachometry.hdl.front_end.decoder import QuadratureDecoder
from tachometry.hdl.front_end.encoder_watch import EncoderWatch
from tachometry.hdl.front_end.glitch_filter import GlitchFilter
from tachometry.hdl.front_end.index_capture import IndexCapture
from tachometry.hdl.front_end.modulo_counter import ModuloCounter
from tachometry.hdl.front_end.open_circuit import OpenCircuit
from tachometry.hdl.front_end.position_counter import PositionCounter
from tachometry.hdl.front_end.probe_latch import ProbeLatch
from tachometry.hdl.front_end.pulse_counter import PulseCounter
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.methods.alteration import AlterationDetector
from tachometry.hdl.methods.gap_timer import GapTimer
from tachometry.hdl.methods.interval import IntervalAccumulator
from tachometry.hdl.methods.m import MMethod, MovingSum
from tachometry.hdl.methods.mt import MTMethod
from tachometry.hdl.methods.quotient_velocity import QuotientVelocity
from tachometry.hdl.methods.rairan import RairanMethod
from tachometry.hdl.methods.rairan_counters import RairanCounters
from tachometry.hdl.methods.tick_counts import TickCounts
from tachometry.hdl.output.compare_output import CompareOutput
from tachometry.hdl.output.over_speed import OverSpeed
from tachometry.hdl.output.record_stream import RecordStream
from tachometry.hdl.output.standstill import Standstill
from tachometry.hdl.output.update_age import UpdateAge


@dataclass(frozen=True)
class Mutant:
    """`right` in the source of `box` made `wrong`: violates `refuted` within `steps` clocks in the proof's core."""

    proof: str
    refuted: str
    box: Any
    right: str
    wrong: str
    steps: int = 24


# A sum that is carried along keeps what an upset has done to it.
RECURSIVE_SUM = (
    """self.total.eq(through - self._earlier(m, before, last))]
        with m.If(self.tick):
            m.d.sync += before.eq(through)
""",
    """self.total.eq(through)]
        with m.If(self.tick):
            m.d.sync += before.eq(through - self._earlier(m, self.m_e, last))
""",
)

MUTANTS = [
    Mutant("x4, 2 clocks", "p1_phase", QuadratureDecoder, "~(level_a ^ past_b)", "~(level_b ^ past_a)"),
    Mutant("x4, filter 3", "p1_phase", GlitchFilter, "held == self._clocks - 1", "held == self._clocks - 2"),
    Mutant("x1, filter 1", "p1_angle", QuadratureDecoder, "~change_b & ~level_b", "~change_b & level_b"),
    Mutant("x4, 2 clocks", "p2_tick", PositionCounter, "step.eq(late)", "step.eq(self.step)"),
    Mutant("x4, 2 clocks", "p2_open", PositionCounter, "before + step", "before - step"),
    Mutant("x4, 2 clocks", "p3_count", PulseCounter, "raised.eq(fresh)", "raised.eq(start)"),
    Mutant("x4, 2 clocks", "p3_count", PulseCounter, "raised.eq(fresh)", "raised.eq(fresh + step)"),
    Mutant("x2, 7 clocks", "p3_tick", SamplingClock, "left.eq(start)", "left.eq(start + 1)"),
    Mutant("x2, 7 clocks", "p3_overflow", saturate_raised, "exceeds = equal", "exceeds = ~equal"),
    Mutant("eq. (21), 1 clock", "p4_update", AlterationDetector, " & differs", ""),
    Mutant(
        "eq. (21), 1 clock",
        "p4_interval",
        IntervalAccumulator,
        "(after_forced - self._max_ticks)",
        "(after_forced - 1 - self._max_ticks)",
    ),
    Mutant(
        "eq. (21), 1 clock",
        "p4_range",
        IntervalAccumulator,
        "self.m_s == self._max_ticks - 1",
        "self.m_s == self._max_ticks",
    ),
    Mutant(
        "eq. (21), 1 clock",
        "p4_latest",
        IntervalAccumulator,
        "closes.eq(self.alteration | longest)",
        "closes.eq(self.alteration)",
    ),
    Mutant("eq. (21), 1 clock", "p4_held", RemainderScaler, "with m.If(valid):", "with m.If(valid | self.load):"),
    Mutant("eq. (21), 1 clock", "p5_numerator", IntervalAccumulator, "- (last << 1) if", "- last if"),
    Mutant("eq. (17)", "p5_numerator", IntervalAccumulator, "else -last", "else -(last << 1)"),
    Mutant("eq. (21), 1 clock", "p5_velocity", RemainderScaler, "total - (step_q << step)", "total + (step_q << step)"),
    Mutant("carried", "p5_velocity", RemainderScaler, "nearest = ~doubled", "nearest = doubled"),
    Mutant("table", "p5_velocity", SerialScaler, "(high ^ low) & ~(low ^ below)", "(high ^ low) & ~below", 32),
    Mutant("M of 3", "pm_velocity", PipelinedScaler, "total - q if last", "total + q if last"),
    Mutant("6 ticks", "p5_reciprocal", CarriedReciprocal, "r.eq(less + corrected)", "r.eq(less)"),
    Mutant(
        "x4, 2 clocks", "p6_error", QuadratureDecoder, "backward, change_a & change_b", "backward, change_a | change_b"
    ),
    Mutant("x4, 2 clocks", "p6_uncounted", QuadratureDecoder, "change_a ^ change_b,", "change_a | change_b,"),
    Mutant("x4, 2 clocks", "p6_quiet", InputConditioner, "(clocks_since_reset[-1])", "(clocks_since_reset[-2])"),
    Mutant("eq. (21), 1 clock", "p7_stalled", IntervalAccumulator, "~opening.any() & was_silent", "was_silent"),
    Mutant("age, 1 clock", "p8_age", UpdateAge, "(self.tick & (age != self._max_age))", "~self.tick"),
    Mutant("age", "p8_age", UpdateAge, "Mux(self.update, fresh, self.before)", "Mux(self.update, 0, self.before)"),
    Mutant("M of 4", "pm_update", MMethod, "valid.eq(self.tick)", "valid.eq(self.tick & total.any())"),
    Mutant("M of 4", "pm_velocity", MovingSum, "wrap = place >= last - 1", "wrap = place >= last - 2"),
    Mutant("M of 3", "pm_velocity", MovingSum, "Mux(full, read.data, 0)", "read.data"),
    Mutant("M of 4", "pm_stalled", Standstill, "init=most)", "init=most - 1)"),
    Mutant("M of 3", "pm_bounds", MMethod, "margin=spec.form.margin", "margin=0"),
    Mutant(
        "M of 4", "pm_known", MMethod, "known.bounds_valid.eq(seen >= spec.average)", "known.bounds_valid.eq(seen != 0)"
    ),
    Mutant("eq. (21), 1 clock", "p7_falls", IntervalAccumulator, "silent & (rests |", "(rests | silent &"),
    Mutant("Rairán", "pr_tick", RairanCounters, "start = cycles - 2", "start = cycles - 1"),
    Mutant("Rairán", "pr_update", RairanCounters, "pulse & (late | due) | turns", "pulse & late | turns"),
    Mutant("Rairán", "pr_estimate", RairanCounters, "in_step.eq(opens)", "in_step.eq(0)", 32),
    Mutant("Rairán", "pr_update", RairanCounters, "(~moved | self.rest)", "~moved", 32),
    Mutant("Rairán", "pr_velocity", RairanMethod, "Mux(high, ~entry[2], entry[0])", "Mux(high, entry[2], entry[0])"),
    Mutant("Rairán", "pr_rest", RairanCounters, "set_(0, update=~self.rest", "set_(1, update=~self.rest", 32),
    Mutant("Rairán", "pr_stalled", Standstill, "left.eq(most)", "left.eq(most - 1)", 32),
    Mutant("Rairán", "pr_range", RairanCounters, "with m.If(full):", "with m.If(0):"),
    Mutant("Rairán", "pr_flag", RairanCounters, "self.beyond.eq(1)", "self.beyond.eq(0)"),
    Mutant("T", "pt_update", QuotientVelocity, "measuring | nearer", "nearer"),
    Mutant("M/T in ticks", "pt_update", MTMethod, "length == self._min_periods", "length == self._min_periods - 1", 32),
    Mutant("M/T of whole cycles", "pt_update", MTMethod, "cycled.eq(0), waived.eq(0)", "cycled.eq(0)", 48),
    Mutant("T in ticks", "pt_spacing", Divider, "left.eq(self._steps - 1)", "left.eq(self._steps - 2)", 32),
    Mutant("T", "pt_interval", GapTimer, "self.age.eq(1)", "self.age.eq(2)"),
    Mutant("T", "pt_range", GapTimer, "self.age == self._max_periods - 1", "self.age == self._max_periods", 32),
    Mutant("T", "pt_velocity", QuotientVelocity, "nearest=True", "nearest=False"),
    Mutant(
        "M/T in ticks",
        "pt_velocity",
        MTMethod,
        "travelled.eq(Mux(opens, 0, total))",
        "travelled.eq(Mux(ends, 0, total))",
        32,
    ),
    Mutant("T", "pt_flag", QuotientVelocity, "beyond | beyond_most", "beyond"),
    Mutant("T in ticks", "pt_flag", QuotientVelocity, "beyond | beyond_most", "beyond_most"),
    Mutant("T", "pt_saturated", QuotientVelocity, "Mux(passes, bound, divider.digit)", "divider.digit"),
    Mutant("T of few digits", "pt_saturated", QuotientVelocity, "Mux(passes, bound, divider.digit)", "divider.digit"),
    Mutant("M/T of few digits", "pt_flag", QuotientVelocity, "farther | too_far", "farther", 40),
    Mutant("T in ticks", "pt_decays", QuotientVelocity, "measuring | nearer", "1"),
    Mutant("T in ticks", "pt_bound", QuotientVelocity, "measuring | nearer", "measuring", 32),
    Mutant("T", "pt_rest", GapTimer, "self.period & longest & ~self.count", "self.period & longest & self.count", 40),
    Mutant("T", "pt_stalled", Standstill, "silent & was_silent", "was_silent", 32),
    Mutant("T", "pt_held", QuotientVelocity, "updates.valid.eq(update)", "updates.valid.eq(update & ~forced)", 32),
    Mutant("upset, x4, filter 3", "p3_count", GlitchFilter, "held.eq(held + 1)", "held.eq(held + (held != 3))"),
    Mutant(
        "upset, eq. (21)",
        "p4_latest",
        IntervalAccumulator,
        "self.m_s + Mux(longest, back, 1)",
        "self.m_s + Mux(longest, back, self.m_s <= self._max_ticks)",
    ),
    Mutant(
        "upset, carried", "p5_velocity", CarriedReciprocal, "with m.If(~self.m[address_bits:].any()):", "with m.If(0):"
    ),
    Mutant("upset, M of 4", "pm_velocity", MovingSum, *RECURSIVE_SUM),
    Mutant("upset, Rairán", "pr_estimate", RairanMethod, "shown = update | at_rest", "shown = update"),
    Mutant("upset, T", "pt_interval", Divider, "left.eq(left - 1)", "left.eq(left - (left < self._steps))"),
    Mutant("upset, M/T: given", "pt_update", MTMethod, "length.eq(length + 1)", "length.eq(length + ~length.all())"),
    Mutant(
        "upset, M/T: travelled",
        "lemma_travelled",
        MTMethod,
        "travelled.eq(Mux(opens, 0, total))",
        "travelled.eq(Mux(ends, 0, total))",
    ),
    Mutant("upset, M/T: since", "lemma_fresh", QuotientVelocity, "measuring | nearer", "nearer"),
    Mutant("upset, M/T", "pt_velocity", Divider, "Cat(1, digits[-1], remainder)", "Cat(1, 0, remainder)"),
    Mutant(
        "upset, M/T of whole cycles: given",
        "lemma_length",
        MTMethod,
        "length.eq(length + 1)",
        "length.eq(length + ~length.all())",
    ),
    Mutant(
        "upset, M/T of whole cycles: travelled",
        "lemma_travelled",
        MTMethod,
        "travelled.eq(Mux(opens, 0, total))",
        "travelled.eq(Mux(ends, 0, total))",
    ),
    Mutant("upset, M/T of whole cycles: since", "lemma_fresh", QuotientVelocity, "measuring | nearer", "nearer"),
    Mutant(
        "upset, M/T of whole cycles", "pt_velocity", Divider, "Cat(1, digits[-1], remainder)", "Cat(1, 0, remainder)"
    ),
    Mutant(
        "upset, M/T of whole cycles: cycles", "lemma_waived", MTMethod, "cycled.eq(0), waived.eq(0)", "cycled.eq(0)"
    ),
    Mutant("counts of a tick", "pk_number", TickCounts, "before != form.most_number", "number != form.most_number"),
    Mutant(
        "counts of a tick",
        "pk_times",
        TickCounts,
        "times.eq(Mux(fresh, 0, times + number))",
        "times.eq(times + number)",
    ),
    Mutant("counts of a tick", "pk_places", TickCounts, "way).as_signed() + self.step", "way).as_signed() + 1"),
    Mutant("counts of a tick", "pk_of_count", TickCounts, "(position - backward)", "position"),
    Mutant("counts of a tick", "pk_moved", TickCounts, "way = Mux(fresh, 0, moved)", "way = moved"),
    Mutant("counts of a tick", "pk_elapsed", TickCounts, "(self.elapsed != self._max_ticks)", "1", 40),
    Mutant("counts of a tick", "pk_length", TickCounts, "length), length.eq(1)", "length), length.eq(0)"),
    Mutant("wishbone", "pb_error", RegisterBank, "(bus.address >= len(self._map.registers))", "0"),
    Mutant("wishbone", "pb_read", RegisterBank, "init=(1 << len(bus.address)) - 1", "init=0"),
    Mutant("wishbone", "pb_snapshot", RegisterBank, "self.capture | (bus.read", "(bus.read"),
    Mutant(
        "axi-lite", "pb_snapshot", RegisterBank, "waits | getattr(self, self._map.events[flag])", "waits | Const(0)"
    ),
    Mutant("axi-lite", "pb_snapshot", TickPosition, "self.next - self.open_sum", "self.position"),
    Mutant("axi-lite", "pb_write", RegisterBank, 'bus.write & here["CONTROL"]', "bus.write"),
    Mutant("wishbone", "pw_access", WishboneBridge, "self.wb_we_i & self.wb_sel_i[0]", "self.wb_we_i"),
    Mutant(
        "wishbone",
        "pw_answer",
        WishboneBridge,
        "ack_o.eq(answered & self.wb_cyc_i & self.wb_stb_i",
        "ack_o.eq(answered",
    ),
    Mutant("wishbone", "pw_error", RegisterBank, "(bus.write & ~writable)", "0"),
    Mutant("wishbone", "pw_data", WishboneBridge, "eq(native.read_data)", "eq(native.read_data >> 1)"),
    Mutant("axi-lite", "pa_ready", AxiLiteBridge, "write_done.eq(0), write.take_aw.eq(1)", "write_done.eq(0)"),
    Mutant("axi-lite", "pa_write", AxiLiteBridge, "writes & write.by_byte_0", "writes"),
    Mutant("axi-lite", "pa_read", AxiLiteBridge, "~read.take_ar & ~read.read_done", "~read.take_ar"),
    Mutant(
        "axi-lite",
        "pa_turn",
        AxiLiteBridge,
        "read_done & ~write.writes",
        "read_done & ~write.writes & ~self.s_axi_awvalid",
    ),
    Mutant("axi-lite", "pa_bound", AxiLiteBridge, "m.If(read.has_read)", "m.If(read.has_read & self.s_axi_rready)"),
    Mutant("axi-lite", "pa_only", AxiLiteBridge, "[self.s_axi_rvalid.eq(0), read", "[read"),
    Mutant("axi-lite", "pa_stable", AxiLiteBridge, "self.s_axi_rvalid & self.s_axi_rready", "self.s_axi_rvalid"),
    Mutant("axi-lite", "pa_written", AxiLiteBridge, "bresp.eq(self._response)", "bresp.eq(0)"),
    Mutant(
        "axi-lite",
        "pa_data",
        AxiLiteBridge,
        "s_axi_rdata.eq(self.native.read_data",
        "s_axi_rdata.eq(self.native.read_data >> 1",
    ),
    Mutant("stream", "ps_valid", RecordStream, "self.event | ~free", "self.event"),
    Mutant("stream", "ps_stable", RecordStream, "~self.m_axis_tvalid | self.m_axis_tready", "1"),
    Mutant("stream", "ps_record", RecordStream, "lost.eq(~free)", "lost.eq(free)"),
    Mutant("stream", "ps_last", RecordStream, "tlast.eq(left == 0)", "tlast.eq(left == 1)"),
    Mutant("stream", "ps_overruns", RecordStream, "self.event & ~free & ~self", "self.event & ~self"),
    Mutant("positions of two axes", "px_position", AxesDatapath, "before.position + count", "before.position", 60),
    Mutant("positions of two axes", "px_once", Turns, "ends & ~final", "ends & final", 40),
    Mutant("two axes of four slots", "px_axis", AxisCounters, "self.axis.eq(slot)", "self.axis.eq(self.slot)"),
    Mutant("two axes of four slots", "px_step", AxisCounters, "write.data.b.eq(new_b)", "write.data.b.eq(b)"),
    Mutant("two axes of four slots", "px_count", AxisCounters, "write.addr.eq(self.axis)", "write.addr.eq(slot)"),
    Mutant("two axes of four slots", "px_count", AxisCounters, "Mux(first, 0, before)", "before", 32),
    Mutant("three axes of five slots", "px_error", AxisCounters, "ready & illegal", "illegal"),
    Mutant("three axes of five slots", "px_complete", Rounds, "self.last.eq(clock.last)", "self.last.eq(self.first)"),
    Mutant("control loop", "pc_total", Controller, "self.position << self._form.position_bits", "0"),
    Mutant("control loop", "pc_word", Controller, "self.held << fine", "self.held"),
    Mutant("control loop", "pc_state", Controller, "stored & due & to_y", "stored", 32),
    Mutant(
        "control loop", "pc_current", Controller, "Mux(taken.enabled, limited, 0)", "Mux(taken.enabled, short, 0)", 52
    ),
    Mutant(
        "control loop, any gains",
        "pc_limit",
        Controller,
        "form.current_limit, form.current_limit, self.current_limit)",
        "form.current_limit, self.current_limit, self.current_limit)",
    ),
    Mutant("control loop", "pc_n", UpdateWindow, "self.n + 1", "self.n + 2", 52),
    Mutant("outputs", "po_modulo", ModuloCounter, "Mux(late[1], self._modulus - 1, 0)", "0"),
    Mutant("outputs", "po_range", ModuloCounter, "Mux(late[1], 0, self._modulus - 1)", "self._modulus"),
    Mutant("outputs", "po_position", PositionCounter, "Mux(self.load, self.value, self.position)", "self.position"),
    Mutant("outputs", "po_trip", OverSpeed, "(above | below)", "above"),
    Mutant("outputs", "po_open", OpenCircuit, "~self.equal | self.clear", "~self.equal"),
    Mutant("outputs", "po_health", EncoderWatch, "with m.If(self.health == 0):", "with m.If(1):"),
    Mutant("outputs", "po_faults", EncoderWatch, "self.faults.eq(self.faults + 1)", "self.faults.eq(1)"),
    Mutant(
        "outputs", "po_line", EncoderWatch, "return last & change_b, last & change_a", "return last, last & change_a"
    ),
    Mutant("outputs", "po_home", IndexCapture, "seen & armed", "seen"),
    Mutant("outputs", "po_homed", IndexCapture, "armed.eq(1), self.homed.eq(0)", "armed.eq(1)"),
    Mutant("outputs", "po_index", IndexCapture, "self.index_position.eq(self.position)", "self.index_position.eq(0)"),
    Mutant("outputs", "po_latches", ProbeLatch, "edge & ~self.probed", "edge"),
    Mutant("outputs", "po_probed", ProbeLatch, "(self.probed | edge) & ~self.arm", "self.probed | edge"),
    Mutant("outputs", "po_latched", ProbeLatch, ".eq(self.position)", ".eq(0)"),
    Mutant("outputs", "po_since", ProbeLatch, "since + ~since.all()", "since + 1"),
    Mutant("outputs", "po_pulse", CompareOutput, "left.eq(left - 1)", "left.eq(0)"),
    Mutant("outputs", "po_place", CompareOutput, "(self.position == awaited)", "1"),
    Mutant("outputs", "po_edge", CompareOutput, "(self.position + back)", "self.position"),
    Mutant("outputs", "po_due", CompareOutput, "awaited.eq(awaited + compare.apart)", "awaited.eq(awaited)"),
    Mutant("outputs", "po_grid", CompareOutput, "number.eq(Mux(back, number - 1, number + 1))", "number.eq(1)"),
    Mutant("upset, outputs", "po_open", OpenCircuit, "~self.equal | self.clear", "self.clear"),
]
