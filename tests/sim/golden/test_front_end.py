"""The golden front end on steps and levels that are made by hand, and expected values of other counters.

These are on the hardware, as docs/concepts/expected.csv lists them.
"""

import re

import numpy as np
import pytest
from numpy.typing import NDArray
from reference.front import CYCLE
from support import docs

from tachometry.sim.engines.pysim import PySim
from tachometry.sim.golden.front_end import Steps, count, decode, decoded, first_beyond
from tachometry.sim.golden.sampling import external_windows, windows
from tachometry.sim.golden.standstill import with_standstill
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import TachometerSpec, of_texts

SMALL = {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "100clk"}
NONE = np.empty(0, dtype=np.int64)


def spec_of(**texts: str) -> TachometerSpec:
    return of_texts("s", SMALL | {name.replace("_", "-"): text for name, text in texts.items()})


def steps_of(clock: list[int], step: list[int], index: list[int] | None = None, swallowed: object = NONE) -> Steps:
    at = [np.array(column, dtype=np.int64) for column in (clock, step, index or [], swallowed)]
    return Steps(at[0], at[1], NONE, at[2], at[3])


def line(*rises_and_falls: int, n_clocks: int) -> NDArray[np.uint8]:
    """Return levels of every clock; the line is low first, and changes in these clocks."""
    level = np.zeros(n_clocks, dtype=np.uint8)
    for clock in rises_and_falls:
        level[clock:] ^= 1
    return level


def trace_of(n_clocks: int, *, a: tuple[int, ...] = (), z: tuple[int, ...] = ()) -> PinTrace:
    levels = [line(*changes, n_clocks=n_clocks) for changes in (a, (), z)]
    return PinTrace(np.arange(n_clocks), levels[0], levels[1], n_clocks, levels[2])


def test_without_an_index_its_line_is_not_looked_at() -> None:
    trace = trace_of(60, a=(5, 25), z=(7, 9, 30))
    assert decoded(spec_of(), trace).index.tolist() == []
    assert decoded(spec_of(index="yes", index_at="edge"), trace).index.tolist() == [7 + 2, 30 + 2]


def test_the_position_of_an_index_before_and_after_counts() -> None:
    _, index = count(spec_of(index="yes"), steps_of([30, 40, 50], [1, 1, -1], [20, 35, 40, 60]), np.arange(9, 76, 10))
    assert index["index_position"].tolist() == [0, 1, 2, 1]


def test_a_glitch_is_counted_when_the_line_has_gone_back() -> None:
    """Two clocks later the synchroniser shows the level to which it went back, and one more clock counts."""
    spec = spec_of(filter="3")
    trace = trace_of(80, a=(20, 22, 40, 50))  # a glitch of two clocks, and a pulse of ten
    found = decoded(spec, trace)
    assert found.swallowed.tolist() == [22 + 3]
    assert found.clock.tolist() == [40 + 5, 50 + 5]
    ticks, _ = count(spec, found, np.arange(9, 76, 10))
    assert ticks.clock.tolist() == [11, 21, 31, 41, 51, 61, 71]
    assert ticks["filtered_edges"].tolist() == [0, 0, 2, 2, 2, 2, 2]
    ticks, _ = count(spec, found, np.array([22, 23]))
    assert ticks["filtered_edges"].tolist() == [0, 2]  # with the strobes in clocks 24 and 25
    preset = PinTrace.of_lines(trace.clock, 80, {"a": 0 * trace.a, "b": trace.b, "preset": trace.a})
    assert decoded(spec_of(filter="3", preset="5"), preset).swallowed.tolist() == [22 + 3]


@pytest.mark.parametrize("width", [8, 11])
@pytest.mark.parametrize("sign", [1, -1])
def test_positions_wrap_in_twos_complement(width: int, sign: int) -> None:
    """A position of w bits is the one of −2^(w−1) … 2^(w−1) − 1 that leaves the same remainder."""
    n = 5 << width
    steps = steps_of([*range(n)], [sign] * n, index=[*range(0, n, 7)])
    last = np.arange(0, n)
    ticks, index = count(spec_of(position_width=str(width), index="yes"), steps, last)
    bits = np.arange(1, n + 1) * sign
    for shown, exact in ((ticks["position"], bits), (index["index_position"], bits[::7])):
        assert set(shown.tolist()) <= set(range(-(1 << width - 1), 1 << width - 1))
        assert not np.any((shown - exact) & ((1 << width) - 1))
    assert index.clock.tolist() == [clock + 2 for clock in range(0, n, 7)]


def test_a_window_holds_the_steps_up_to_its_last_clock() -> None:
    steps = steps_of([0, 9, 10, 19, 20, 21], [1, 1, 1, -1, 1, 1])
    ticks, _ = count(spec_of(), steps, np.array([9, 19, 29]))
    assert ticks["pulse_count"].tolist() == [2, 0, 2]
    assert ticks["position"].tolist() == [2, 2, 4]
    assert not ticks["overflow"].any()


def test_the_index_takes_its_position_off() -> None:
    """A step in the clock of the index is taken off, one in the clock after is not."""
    steps = steps_of([0, 9, 10, 14, 15, 30], [1, 1, 1, 1, 1, -1], index=[14, 28])
    plain, captured = count(spec_of(index="yes"), steps, np.array([9, 13, 14, 19, 29, 39]))
    assert plain["position"].tolist() == [2, 3, 4, 5, 5, 4]
    assert captured["index_position"].tolist() == [4, 5]
    reset, captured = count(spec_of(index="yes", index_reset="yes"), steps, np.array([9, 13, 14, 19, 29, 39]))
    assert reset["position"].tolist() == [2, 3, 0, 1, 0, -1]
    assert captured["index_position"].tolist() == [4, 1]


def test_ticks_of_a_method_that_ends_them_itself_stay_saturated() -> None:
    """The sum of the first left the bound and came back; that of the third is at it; the method flags the last."""
    spec = of_texts("rairan", SMALL | {"max-speed": "39269rad/s"})  # two counts a tick
    assert spec.widths.max_pulse_count == 2
    steps = steps_of([*range(5), *range(20, 23), 40, 41, 60], [-1, -1, -1, 1, 1, 1, 1, 1, 1, 1, 1])
    ticks, _ = count(spec, steps, np.array([9, 29, 49, 69, 89]), np.array([False, False, False, False, True]))
    assert ticks["pulse_count"].tolist() == [-2, 2, 2, 1, 0]
    assert ticks["overflow"].tolist() == [True, True, False, False, True]
    ticks, _ = count(spec, steps, np.array([9, 29, 49, 69, 89]))
    assert ticks["pulse_count"].tolist() == [-1, 2, 2, 1, 0]
    assert ticks["overflow"].tolist() == [False, True, False, False, False]


@pytest.mark.parametrize(("decoding", "steps"), [(4, "+++++ ---- +++"), (2, "+0+0+ -0-0 0+0"), (1, "+000+ -000 000")])
def test_decoding(decoding: int, steps: str) -> None:
    """Forward is 00, 10, 11, 01: A leads. x2 counts the edges of A, x1 those with B low."""
    quarters = np.array([0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 2, 3, 4])
    a, b = np.array([CYCLE[quarter % 4] for quarter in quarters.tolist()], dtype=np.uint8).T
    found, illegal = decode(a, b, decoding)
    wanted = [{"+": 1, "-": -1, "0": 0}[sign] for sign in steps.replace(" ", "")]
    assert found.tolist() == wanted
    assert not illegal.any()
    both = np.array([0, 1, 0, 0, 1], dtype=np.uint8), np.array([0, 1, 0, 1, 0], dtype=np.uint8)
    found, illegal = decode(*both, decoding)
    assert illegal.tolist() == [True, True, False, True]
    assert found.tolist() == [0, 0, -1 if decoding == 4 else 0, 0]


def left_first(clock: list[int], step: list[int], last: list[int], limit: int) -> list[int]:
    """Return the same step by step: the sign with which the sum of a window leaves ±limit for the first time."""
    found, window, total = [0] * len(last), 0, 0
    for at, one in zip(clock, step, strict=True):
        while window < len(last) and at > last[window]:
            window, total = window + 1, 0
        total += one
        if window < len(last) and abs(total) > limit and not found[window]:
            found[window] = 1 if total > 0 else -1
    return found


@pytest.mark.parametrize("limit", [0, 1, 2, 5])
def test_the_first_excess_of_every_window(limit: int) -> None:
    """The sum may come back, or leave on the other side later; windows before the first step are empty."""
    assert first_beyond(steps_of([30, 31], [1, 1]), np.array([9, 19, 39]), 1).tolist() == [0, 0, 1]
    for seed in range(20):
        rng = np.random.default_rng([limit, seed])
        clock = np.flatnonzero(rng.random(400) < rng.choice([0.1, 0.6])) + int(rng.integers(60))
        step = rng.choice([-1, 1, 1], len(clock)) if seed % 2 else rng.choice([-1, 1], len(clock))
        last = np.flatnonzero(rng.random(460) < 0.1)
        found = first_beyond(steps_of(clock.tolist(), step.tolist()), last, limit)
        assert found.tolist() == left_first(clock.tolist(), step.tolist(), last.tolist(), limit), seed


@pytest.mark.parametrize("n_clocks", [60, 61, 62, 63])
def test_own_windows_are_those_whose_tick_is_within_the_trace(n_clocks: int) -> None:
    last, errors = windows(spec_of(), trace_of(n_clocks))
    assert last.tolist() == [clock for clock in range(9, n_clocks, 10) if clock + 2 < n_clocks]
    assert errors.tolist() == []


@pytest.mark.parametrize("n_clocks", [50, 51, 52, 53])
def test_external_windows_are_those_whose_tick_is_within_the_trace(n_clocks: int) -> None:
    """A rise is seen two clocks after it was sampled, and the tick comes two clocks after that."""
    spec = spec_of(external_tick="yes")
    trace = trace_of(n_clocks).with_tick_in(np.array([15, 30, 47]))
    last, errors = windows(spec, trace)
    assert last.tolist() == [clock + 2 for clock in (15, 30, 47) if clock + 4 < n_clocks]
    assert errors.tolist() == []


def test_an_external_tick_that_is_high_at_first_has_not_risen() -> None:
    low = trace_of(60)
    trace = PinTrace(low.clock, low.a, low.b, 60, tick_in=1 - line(5, 15, 22, n_clocks=60))
    assert windows(spec_of(external_tick="yes"), trace)[0].tolist()[0] == 15 + 2


def test_ends_that_are_missing_are_made_and_rises_that_come_early_are_left_out() -> None:
    last, errors = external_windows(np.array([9, 11, 30, 61]), 100, min_cycles=4, max_cycles=20)
    assert last.tolist() == [9, 29, 49, 61, 81]
    assert errors.tolist() == [11, 29, 30, 49, 81]


SPEC = of_texts("s", {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "40clk"})  # four ticks


@pytest.mark.parametrize(
    ("numbers", "lengths", "standstill"),
    [
        # The tick before the first one counts as empty.
        ("000000", "111111", "000111"),
        ("100000", "111111", "000001"),
        ("010000-0", "11111111", "00000000"),
        ("0100000-0", "111111111", "000000100"),
        # Of a tick that is longer than nominal, so much more.
        ("0000", "1111", "0001"),
        ("0100", "1423", "0001"),
        ("0100", "1222", "0000"),
    ],
)
def test_rest(numbers: str, lengths: str, standstill: str) -> None:
    m_e = np.array([{"0": 0, "1": 1, "-": -1}[number] for number in numbers])
    ticks = Table(np.arange(len(m_e)), {"pulse_count": m_e})
    found = with_standstill(SPEC, ticks, np.array([int(length) for length in lengths])).standstill
    assert "".join(str(int(one)) for one in found) == standstill


CORE = {"ppr": "8", "clock": "1MHz", "tick": "1clk", "max-time": "10clk"}
ROWS = [(*row.values(),) for row in docs.table("expected", "concepts")]


@pytest.mark.parametrize("row", ROWS, ids=[f"{row[0]}: {row[1]}" for row in ROWS])
def test_our_values(row: tuple[str, ...]) -> None:
    """Where theirs differ, the situation has a number, which says why."""
    _, situation, options, lines, theirs, ours, captured = row
    assert (theirs == ours) == (not re.search(r"\([124]\)$", situation))
    texts = dict(CORE)
    for option in re.findall(r"--(\S+(?: [^-\s]\S*)?)", options):
        name, _, value = option.partition(" ")
        texts[name] = value or "yes"
    spec = of_texts("s", texts)
    words, apart = lines.split(), 1 if "1 clock apart" in options else 10
    levels = {name: [0] for name in "abz"}
    for word in words:
        for name, level in levels.items():
            level.append(level[-1] ^ (name.upper() in word))
    clock = np.append(0, 20 + apart * np.arange(len(words)))
    pins = {name: np.array(level, dtype=np.uint8) for name, level in levels.items()}
    trace = PinTrace(clock, pins["a"], pins["b"], int(clock[-1]) + 40, pins["z"])
    found = lockstep(spec, trace, PySim())
    assert found.n_mismatches == 0
    settled = np.append(clock[2:], trace.n_clocks - 20) - 1 + spec.latency.pin_to_count + spec.latency.tick
    ticks = found.actual.ticks
    shown = ticks.position[np.searchsorted(ticks.clock, settled, side="right") - 1].tolist()
    wanted = [int(word) for word in ours.split()]
    assert shown[-len(wanted) :] == wanted
    if captured:
        assert found.actual.index.index_position[-1] == int(captured)


def test_there_is_a_row_of_each() -> None:
    assert {row[0] for row in ROWS} == {"PandABlocks qdec", "LinuxCNC encoder", "TI eQEP", "LS7366R"}
