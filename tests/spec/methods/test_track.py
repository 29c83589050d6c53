"""Options, widths and latencies of the tracking core, and what is refused."""

from fractions import Fraction

import pytest
from support.tracking import core

from tachometry.spec import ParameterError, TrackTachometer, of_options, with_loop
from tachometry.spec.formats.tracking import WIDTH
from tachometry.spec.formats.tracking_code import FIRST_INPUT, FIRST_OFFSET
from tachometry.spec.formats.tracking_instruction import OFFSETS
from tachometry.spec.formats.tracking_units import BLOCK, Serial
from tachometry.spec.methods.track import in_loop


def test_ends_of_ranges() -> None:
    assert [core(position_fine_bits=bits).position_fine_bits for bits in ("1", "16")] == [1, 16]
    assert [core(max_memory=time).max_memory for time in ("960clk", "20us", "4s")] == [960, 960, 192_000_000]
    assert core().max_memory is None


def test_the_memory_in_a_loop_follows_from_its_gain() -> None:
    """It is 0.6/k_v, from a tick to 4 s, unless it is given; the options of the core make it again."""
    for gain, memory in (("120", 240_000), ("1/10", 192_000_000), ("1000000", 960)):
        assert in_loop(core(), Fraction(gain)) == core(max_memory=f"{memory}clk")
    loop = with_loop(core(max_speed="400rad/s"), {"kv": "80", "loop-multiplier": "parallel"})
    assert loop.options["max-memory"] == "7.5ms"
    assert loop.tachometer.words.heading == "Tracking method, memory of at most 7.5ms"
    assert loop.tachometer.words.description.endswith(" length, memory of at most 7.5ms")
    assert of_options(loop.options) == loop
    assert with_loop(core(max_memory="1ms"), {"loop-multiplier": "parallel"}).options["max-memory"] == "1ms"


def with_tick(cycles: int, multiplier: str) -> TrackTachometer:
    return core(tick=f"{cycles}clk", max_time=f"{500 * cycles}clk", multiplier=multiplier)


@pytest.mark.parametrize("multiplier", ["serial", "block"])
def test_the_shortest_tick_is_that_of_the_program(multiplier: str) -> None:
    """The update comes earlier, and the velocity of the quick machine before the rest of it."""
    spec = core(multiplier=multiplier)
    shortest = spec.times.min_tick_cycles
    assert shortest == spec.program.all_clocks == spec.latency.busy <= {"serial": 870, "block": 260}[multiplier]
    assert spec.latency.datapath == spec.program.velocity_clocks <= spec.latency.native_update == spec.program.clocks
    assert spec.program.clocks < shortest
    assert ("tick_to_update" in spec.latency_entries) == (multiplier == "block")
    assert with_tick(shortest, multiplier).times.min_tick_cycles == shortest
    with pytest.raises(ParameterError, match=r"^tick must be longer for method track"):
        with_tick(shortest - 1, multiplier)


def test_the_multiplier_is_serial_where_that_fits_the_tick() -> None:
    serial = core(multiplier="serial").times.min_tick_cycles
    for cycles, block in ((serial, False), (serial - 1, True)):
        assert (with_tick(cycles, "auto").program.times == BLOCK) == block
    assert core(multiplier="block").program.times == BLOCK
    assert core(multiplier="block").latency.datapath < core(multiplier="serial").latency.datapath / 2


@pytest.mark.parametrize("options", [{}, {"ppr": "16", "decoding": "1"}, {"ppr": "81000", "max_speed": "2000rpm"}])
@pytest.mark.parametrize("times", [{}, {"clock": "12MHz", "tick": "100us"}, {"tick": "1ms"}, {"clock": "100MHz"}])
def test_words_hold_the_greatest_speed_and_acceleration(options: dict[str, str], times: dict[str, str]) -> None:
    """Eight times the greatest speed fits, and what is finer than a place in a tick at any."""
    spec = core(**options, **times)
    form = spec.form
    most = 2 ** (WIDTH - 2)
    speed = Fraction(form.max_count, form.longest_tick)
    assert 8 * speed * 2**form.velocity_bits <= most < 32 * speed * 2**form.velocity_bits
    counts = spec.encoder.counts_per_rev
    finer = 2000 / max(counts, 2000)  # in rad/s² half as much for counts that are four times as fine
    acceleration = 1e5 * finer**0.5 * counts / 6.2832 / spec.timing.clock_hz**2
    assert acceleration * 2**form.acceleration_bits <= most < 4 * acceleration * 2**form.acceleration_bits
    assert (form.longest_tick << form.time_bits) < 1 << form.factor_bits
    assert form.most_number * (form.longest_tick - 1) < 1 << form.times_bits
    assert all(0 <= shift < 64 for _, shift in spec.program.shifts)
    assert all(Serial(form).pairs(*shift) <= 32 for shift in spec.program.shifts)  # six bits, signed
    assert len(spec.program.shifts) < 15  # each has a number of four bits, the last of which is another
    assert all(abs(value) < 1 << WIDTH - 1 for value in spec.program.words.values())
    assert len(spec.program.words) <= FIRST_INPUT
    places = [spec.program.addresses[name] for name in (*OFFSETS[:4], "zero")]
    assert places == [*range(FIRST_OFFSET, FIRST_OFFSET + 5)]  # hardware adds which one is meant
