"""Offsets of a period, from the rows that a core shows, its pins and the words of the command line alone."""

import numpy as np
from extras.harness import BASE, Case, agreeing, in_icarus, on_a_bus, refused
from support.simulate import clock_by_clock

from tachometry.hdl.extras.period_offsets import Gates
from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import of_texts

READS = "sensor=sampled ppr=4096 bits=12 period=8 period-offsets=yes multiplier=block tick=400clk max-time=4000clk"
CASES = (Case("track", READS, edges=60, clocks=150_000),)


def rule(case: Case) -> None:
    """Nobody writes: the offsets are learned, and their sum is about 0."""
    assert {row.period_offset for row in case.rows() if row.tick} > {0}


def test_what_was_read_is_written_back() -> None:
    """A core begins with what another has learned, and shows it until it learns more."""
    texts = BASE | dict(word.split("=", 1) for word in READS.split()) | {"tick": "1ms", "period": "64"}
    spec = of_texts("track", texts | {"max-time": "20ms"})
    truth = encoder_of(spec, noise=0.2, interpolation=(0.8, 64), seed=1).record(parse_motion("constant:31rad/s:500ms"))
    pins = PinTrace.of(truth.recording, spec).completed(spec)
    tick = golden.run(spec, pins).ticks.clock
    learned = [golden.run(spec, driven(pins, {}, number)).ticks.period_offset[-1] for number in range(8)]
    assert abs(sum(learned)) < 0.1 * max(learned)
    writes = {int(tick[2 + number]) + 9: (number, int(word)) for number, word in enumerate(learned)}
    writes = {int(tick[0]) - 50: (0, int(learned[0])), **{at: one for at, one in writes.items() if one[0]}}
    for number in range(8):
        shown = golden.run(spec, driven(pins, writes, number)).ticks.period_offset
        assert shown[[1, 12]].tolist() == [0, learned[number]], number


def driven(pins: PinTrace, writes: dict[int, tuple[int, int]], number: int) -> PinTrace:
    """Return a trace in which offsets are written in these clocks, each for some ticks, and one is read otherwise."""
    clock = np.union1d(pins.clock, [at + more for at in writes for more in (0, 1, 1100)]).astype(np.int64)
    lines = dict(pins.at(clock)) | {name: np.zeros(len(clock), np.int64) for name in ("period_data", "period_write")}
    lines["period_address"] = np.full(len(clock), number)
    for at, (place, word) in writes.items():
        during = (clock >= at) & (clock < at + 1100)
        lines["period_data"][during], lines["period_address"][during] = word, place
        lines["period_write"][clock == at] = 1
    return PinTrace.of_lines(clock, pins.n_clocks, lines)


def test_a_write_waits_for_the_next_tick_but_the_first() -> None:
    """Even in the clock of a tick, or before the first one."""
    rows = [{"tick": tick, "period_write": write} for tick, write in ((0, 1), (1, 0), (0, 0), (1, 1), (1, 0), (1, 0))]
    seen = clock_by_clock(Gates(), rows, ["offset_written"])
    assert [one["offset_written"] for one in seen] == [0, 0, 0, 1, 1, 0]


test_cores = agreeing(CASES, rule)
test_bus = on_a_bus(CASES[0])
test_verilog = in_icarus(CASES[0])  # where registers without a reset are unknown at first
test_refusals = refused(
    {
        READS.replace("period=8 ", ""): "period_offsets must be given with --period N",
        "period-offsets=yes": "period_offsets must be given with --period N",
    },
    "track",
)
