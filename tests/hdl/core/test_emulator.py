"""The encoder emulator against its golden model, and against what its settings mean."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.core import emulator
from tachometry.sim.golden import tables
from tachometry.sim.golden.emulator import Change, GoldenEmulator
from tachometry.spec import of_texts
from tachometry.spec.core.extras.health import Fault
from tachometry.spec.registers.emulator import LATENCY, EmulatorSettings

CLOCKS, SEEDS = 3000, range(8)
PLACE = 2  # of the index


def random_changes(seed: int) -> list[Change]:
    """Return settings of all kinds, some of which make the errors overlap."""
    rng = np.random.default_rng(seed)
    changes = []
    for clock in np.sort(rng.choice(np.arange(-1, CLOCKS), rng.integers(1, 12), replace=False)).tolist():
        speed = int(rng.integers(-(1 << 31), 1 << 31)) >> int(rng.integers(0, 10))
        settings = EmulatorSettings(
            speed=speed,
            rate=int(rng.integers(1 << 32)) >> int(rng.integers(0, 10)) if rng.random() < 0.7 else 0,
            **{name: int(rng.integers(-128, 128)) for name in ("phase_error", "duty_a", "duty_b")},
            jitter=(1 << int(rng.integers(0, 7))) - 1,
            bounce=int(rng.integers(256)) >> int(rng.integers(0, 9)),
            drop=int(rng.integers(256)) >> int(rng.integers(0, 9)),
            glitches=int(rng.integers(256)),
            **{name: int(rng.integers(8)) * int(rng.random() < 0.3) for name in ("broken", "stuck")},
        )
        changes.append(Change(clock, settings, bool(clock >= 0 and rng.random() < 0.3)))
    return changes


def emulated(changes: list[Change], n_clocks: int, lines_per_rev: int | None) -> list[tuple[int, ...]]:
    """Return levels of the gates' lines in each clock."""
    rows: list[dict[str, int]] = [{"jump": 0} for _ in range(n_clocks)]
    for change in changes:
        if change.clock + 1 < n_clocks:
            rows[change.clock + 1] |= asdict(change.settings)
        if change.jump:
            rows[change.clock]["jump"] = 1
    lines = lines_of(lines_per_rev)
    names = [*lines, *(f"{line}_n" for line in lines)]
    seen = clock_by_clock(emulator.EncoderEmulator(lines_per_rev, PLACE, lines), rows, names)
    return [tuple(row[name] for name in names) for row in seen]


def lines_of(lines_per_rev: int | None) -> tuple[str, ...]:
    return ("a", "b") if lines_per_rev is None else ("a", "b", "z")


@pytest.mark.parametrize("seed", SEEDS)
def test_lines_are_those_of_the_golden_model(seed: int) -> None:
    check(random_changes(seed), [None, 1, 5][seed % 3])


def check(changes: list[Change], lines_per_rev: int | None) -> None:
    trace = GoldenEmulator(lines_per_rev, PLACE, lines_of(lines_per_rev)).trace(changes, CLOCKS)
    row = np.searchsorted(trace.clock, np.arange(CLOCKS), side="right") - 1
    levels = np.stack(list(trace.lines.values()), axis=1)[row].tolist()
    for clock, (got, wanted) in enumerate(zip(emulated(changes, CLOCKS, lines_per_rev), levels, strict=True)):
        assert got == tuple(wanted), f"clock {clock}"


def edges(settings: EmulatorSettings, n_clocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Return clocks of the edges of A and of B."""
    trace = GoldenEmulator().trace([Change(-1, settings)], n_clocks)
    return tuple(trace.clock[1:][np.diff(line.astype(int)) != 0] for line in (trace.a, trace.b))


PERIOD = 4096

STEADY = EmulatorSettings(speed=(1 << 32) // PERIOD)


def test_jitter_from_the_start() -> None:
    """No number is drawn in the first clock, which no edge is before."""
    check([Change(-1, replace(STEADY, jitter=63))], None)


def test_a_steady_speed_gives_even_edges_and_forward_is_a_before_b() -> None:
    a, b = edges(STEADY, 20 * PERIOD)
    assert set(np.diff(a)) == set(np.diff(b)) == {PERIOD // 2}
    assert set(b[: len(a)] - a[: len(b)]) == {PERIOD // 4}
    a, b = edges(replace(STEADY, speed=-STEADY.speed), 20 * PERIOD)
    assert set(a[: len(b)] - b[: len(a)]) == {PERIOD // 4}


def test_errors_are_in_1024ths_of_a_period() -> None:
    step = PERIOD // 1024
    a, b = edges(replace(STEADY, phase_error=20, duty_a=-7, duty_b=100), 20 * PERIOD)
    assert set(np.diff(a)) == {PERIOD // 2 - 7 * step, PERIOD // 2 + 7 * step}
    assert set(np.diff(b)) == {PERIOD // 2 + 100 * step, PERIOD // 2 - 100 * step}
    assert b[0] - a[0] == PERIOD // 4 + 20 * step


def test_jitter_moves_every_edge_and_has_no_mean() -> None:
    a, _ = edges(replace(STEADY, jitter=63), 2000 * PERIOD)
    straight, _ = edges(STEADY, 2000 * PERIOD)
    late = (a - straight) / (PERIOD / 1024)
    assert len(a) == len(straight)
    assert np.abs(late).max() <= 63
    # The difference of two even distributions over 64 values.
    assert abs(late.mean()) < 1
    assert 0.95 < late.std() / np.sqrt((64**2 - 1) / 6) < 1.05


def test_some_edges_are_dropped() -> None:
    _, ideal = edges(STEADY, 2000 * PERIOD)
    _, b = edges(replace(STEADY, drop=64), 2000 * PERIOD)
    # Each gap that a dropped edge leaves takes the edge after it, too, if that is not dropped as well.
    lost = 1 - len(b) / len(ideal)
    assert 0.3 < lost < 0.5


def test_lines_bounce_for_as_long_as_asked() -> None:
    a, _ = edges(replace(STEADY, bounce=100), 400 * PERIOD)
    ideal, _ = edges(STEADY, 400 * PERIOD)
    since = a - ideal[np.searchsorted(ideal, a, side="right") - 1]
    assert since.max() in (99, 100)
    assert len(a) > 20 * len(ideal)


def test_lines_at_fault() -> None:
    """A broken line is high, one that is stuck stays, and noise turns both round in a part of all clocks."""
    at_fault = replace(STEADY, broken=1 | 4, stuck=2)
    trace = GoldenEmulator(1).trace([Change(-1, STEADY), Change(10 * PERIOD, at_fault)], 100 * PERIOD)
    late = trace.clock > 10 * PERIOD + LATENCY
    assert trace.clock[late].tolist() == []
    assert trace.z is not None
    assert (trace.a[-1], trace.z[-1]) == (1, 1)
    noisy = GoldenEmulator().trace([Change(-1, replace(STEADY, glitches=255))], 1000 * PERIOD)
    turned = np.flatnonzero((np.diff(noisy.a.astype(int)) != 0) & (np.diff(noisy.b.astype(int)) != 0))
    assert 0.5 < len(turned) / 2 / (1000 * PERIOD * 255 / 65536) < 1.2


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        ({"broken": 1}, Fault.A_STANDS),
        ({"stuck": 2}, Fault.B_STANDS),
        ({"glitches": 99}, Fault.ILLEGAL),
        ({"broken": 2}, Fault.B_OPEN),
    ],
)
def test_a_core_tells_them(fault: dict[str, int], code: Fault) -> None:
    """Within twice as many edges of the line that still works as make a fault, as docs/guides/outputs.md has it."""
    words = {"ppr": "25", "clock": "1MHz", "tick": "100us", "health": "yes", "health-edges": "5", "health-errors": "3"}
    spec = of_texts("m", words | ({"differential": "3"} if code == Fault.B_OPEN else {}))
    begins = 20 * PERIOD
    changes = [Change(-1, STEADY), Change(begins, replace(STEADY, **fault))]
    emulated = GoldenEmulator(complemented=spec.front_end.complemented)
    found = tables(spec, emulated.trace(changes, 60 * PERIOD))["fault"]
    assert found["code"][0] == code
    assert 0 < found.clock[0] - begins < 10 * PERIOD // 2


def test_the_speed_changes_at_the_rate() -> None:
    rate = 1 << 21  # in two clocks: reaches 2^20 phase a clock in 2^16 clocks
    a, _ = edges(EmulatorSettings(speed=1 << 20, rate=rate), 1 << 19)
    periods = (a[-1] - 2**16 / 2) * 2**20 / 2**32  # half of the ramp is missing
    assert abs(len(a) / 2 - periods) <= 1


def test_a_ramp_that_is_changed_in_the_first_clock() -> None:
    check([Change(clock, EmulatorSettings(speed=(5 + clock) << 28, rate=1 << 31)) for clock in (-1, 0)], None)


@pytest.mark.parametrize("clock", [1 << 16, (1 << 16) + 1])
def test_a_ramp_turns_round_without_a_jump(clock: int) -> None:
    ramp = EmulatorSettings(speed=1 << 28, rate=1 << 27)
    changes = [Change(-1, ramp), Change(clock, replace(ramp, speed=-ramp.speed))]
    trace = GoldenEmulator().trace(changes, 5 << 14)
    # The speed is 2^26 where the ramp turns, and 3·2^24 at the end.
    periods = (2**26 * 2**16 / 2 + 7 * 2**23 * 2**14) / 2**32
    assert abs(len(trace.clock) / 4 - periods) <= 1


def test_a_jump_changes_both_lines_at_once() -> None:
    trace = GoldenEmulator().trace([Change(10, EmulatorSettings(), jump=True)], 100)
    assert trace.clock.tolist() == [0, 11 + LATENCY]
    assert (trace.a.tolist(), trace.b.tolist()) == ([0, 1], [0, 1])
