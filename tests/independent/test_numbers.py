"""Numbers that options and pages name, computed here from their words."""

import math
from bisect import bisect_right
from collections.abc import Callable, Sequence
from itertools import accumulate
from typing import Any

import pytest
from reference.front import CYCLE

Found = Callable[..., Any]
BASE = {"method": "m", "ppr": "500", "clock": "1MHz", "tick": "100clk", "max-time": "1000clk"}
WATCHED = BASE | {"clock": "1kHz", "tick": "10ms", "max-time": "100ms", "health": "yes"}


def turned(steps: Sequence[int]) -> dict[str, list[int]]:
    """Return levels of A and B before and after each of these steps."""
    levels = [CYCLE[place % 4] for place in accumulate(steps, initial=0)]
    return {"a": [a for a, _ in levels], "b": [b for _, b in levels]}


@pytest.mark.parametrize(("option", "size"), [("rev", 240), ("rev/1", 240), ("rev/3", 80), ("rev/4", 60), ("7", 7)])
def test_position_modulo_is_within_a_pole_pair(golden: Found, option: str, size: int) -> None:
    """60 pulses are 240 counts a revolution: of 3 pole pairs, 80 are a turn of the electrical angle."""
    steps = [1] * 500 + [-1] * 900
    words = BASE | {"ppr": "60", "position-modulo": option}
    ticks = golden(words, range(0, 50 * len(steps) + 1, 50), 71_000, **turned(steps))["tick"]
    assert ticks.position_modulo.tolist() == [position % size for position in ticks.position.tolist()]
    assert ticks.position_modulo.max() == size - 1


@pytest.mark.parametrize(("counts", "parts"), [(240, 7), (20_000, 21), (20_000, 7)])
def test_position_modulo_counts_from_an_electrical_zero(golden: Found, counts: int, parts: int) -> None:
    """No part has whole counts: every part begins with the first count that is not before its zero."""
    steps = [1] * 2500 + [-1] * 4000
    words = BASE | {"ppr": str(counts // 4), "position-modulo": f"rev/{parts}"}
    ticks = golden(words, range(0, 50 * len(steps) + 1, 50), 326_000, **turned(steps))["tick"]
    zeros = [math.ceil(part * counts / parts) for part in range(-50 * parts, 80 * parts)]
    since = [place - zeros[bisect_right(zeros, place) - 1] for place in ticks.position.tolist()]
    assert ticks.position_modulo.tolist() == since


@pytest.mark.parametrize("number", [100, 1024, 3 << 24])
def test_position_modulo_of_reads_goes_on_where_positions_wrap(golden: Found, number: int) -> None:
    """Of a shaft with 16 counts in a turn, far forward and back; the position has 8 bits."""
    places = [*range(3, 3000, 7), *range(3000, -3000, -5)]
    words = {name: word for name, word in BASE.items() if name != "ppr"} | {"sensor": "sampled", "bits": "4"}
    words |= {"position-width": "8", "position-modulo": str(number), "zero": "-30"}
    lines = {"sample": [place % 16 for place in places for _ in "10"], "sample_valid": [1, 0] * len(places)}
    lines |= {"sample_ok": [1], "sample_age": [0], "a": [0], "b": [0]}
    ticks = golden(words, range(0, 100 * len(places), 50), 100 * len(places) + 40, **lines)["tick"]
    assert ticks.position_modulo.tolist() == [(place + 30) % number for place in places]
    assert ticks.position.tolist() == [(place + 30 + 128) % 256 - 128 for place in places]


@pytest.mark.parametrize(("speed", "greatest"), [("1rev/s", 64), ("1.01rev/s", 64), ("60.9rpm", 64), ("59.9rpm", 63)])
@pytest.mark.parametrize("sign", [1, -1])
def test_over_speed_trips_beyond_the_speed(golden: Found, speed: str, greatest: int, sign: int) -> None:
    """4000 counts a revolution and ticks of 1 ms: 1 rev/s is 4 counts a tick, 64 LSB of 2^-4."""
    words = {"tick": "1000clk", "max-time": "10ms", "ppr": "1000", "average": "16", "frac-bits": "4"}
    for last in (greatest, greatest + 1):
        counts = [4] * 16 + [4 + last - 64] + [4] * 20  # their mean is 64 LSB, then the last one
        clocks = [0] + [1000 * tick + 200 * k + 100 for tick, n in enumerate(counts) for k in range(n)]
        found = golden(BASE | words | {"over-speed": speed}, clocks, 38_000, **turned([sign] * (len(clocks) - 1)))
        assert bool(found["tick"].over_speed[-1]) == (max(last, 64) > greatest)


# A second of a clock of 1 kHz is 1000 clocks, the first one from reset on. A without B is fault 2, both at once are 4.
@pytest.mark.parametrize(
    ("times", "more", "fault"),
    [
        ((20, 300, 600, 960), {"health-edges": "4"}, 2), ((20, 300, 600, 1040), {"health-edges": "4"}, 0),
        (range(20, 788, 3), {}, 2), (range(20, 785, 3), {}, 0),
        ((20, 500, 960), {"health-errors": "2"}, 4), ((20, 500, 1040), {"health-errors": "2"}, 0),
        ((20, 500), {"health-errors": "2"}, 0), (range(20, 900, 80), {}, 4), (range(20, 800, 80), {}, 0),
    ],
)  # fmt: skip
def test_health_counts_in_a_second(golden: Found, times: Sequence[int], more: dict[str, str], fault: int) -> None:
    """N edges of A, 256 if it is not said, or more than N illegal transitions, 10 if it is not said."""
    level = [nth % 2 for nth in range(len(times) + 1)]
    edges = "health-edges" in more or len(times) > 200
    ticks = golden(WATCHED | more, [0, *times], 1200, a=level, b=0 if edges else level)["tick"]
    assert (ticks.health[-1], ticks.faults[-1]) == (fault, fault > 0)


def test_overruns_stay_at_65535(golden: Found) -> None:
    """Nobody takes a record: the first one waits, and all others are dropped."""
    words = BASE | {"tick": "2clk", "max-time": "20clk", "stream": "axi:tick"}
    found = golden(words, [0], 140_000, a=0, b=0, m_axis_tready=0)["tick"].overruns.tolist()
    assert found == [min(max(nth - 1, 0), 65_535) for nth in range(len(found))]


def test_swallowed_edges_stay_at_65534(golden: Found) -> None:
    """Two for each of 33,000 glitches, ten of which are in a tick."""
    clocks = [0, *(10 * k + at for k in range(1, 33_001) for at in (0, 1))]
    level = [nth % 2 for nth in range(len(clocks))]
    found = golden(BASE | {"filter": "3"}, clocks, 330_100, a=level, b=0)["tick"].filtered_edges.tolist()
    assert (found[0], found[1000], found[-1]) == (18, 20_018, 65_534)


@pytest.mark.parametrize(("sign", "glitches"), [(1, "0"), (-1, "5clk")])
def test_a_fine_pulse_begins_when_the_shaft_is_there(golden: Found, sign: int, glitches: str) -> None:
    """In the first clock, of the pins, in which it is: the edge to position 1 lies at 1/2."""
    words = {"method": "track", "clock": "20MHz", "tick": "50us", "max-time": "100ms", "position-fine-bits": "16"}
    words["position-compare"] = "3.5:7.3125:0:1clk:fine" if sign > 0 else "-3.5:7.3125:0:1clk:backward:fine"
    clocks = range(0, 37 * 40_000 + 1, 37)
    pulses = golden(BASE | words | {"filter": glitches}, clocks, clocks[-1], **turned([sign] * 40_000))[
        "position_compare_valid"
    ]
    late = (pulses.clock - 37 * (sign * pulses.position_compare_position / 2**16 + 1 / 2))[3000:]
    assert (abs(late - 1 / 2) < 0.6).all()
    assert late.mean() == pytest.approx(1 / 2, abs=0.1)


@pytest.mark.parametrize(
    ("words", "sizes"),
    [
        ({}, {"position": 4, "velocity": 4}),
        ({"position-width": "33"}, {"position": 8, "velocity": 4}),
        ({"velocity-width": "33", "frac-bits": "24"}, {"velocity": 8, "position": 4}),
        ({"method": "track"}, {"velocity": 8, "position_fine": 8, "position": 4, "acceleration": 4}),
    ],
)
def test_records_hold_words_of_4_or_8_bytes(described: Found, words: dict[str, str], sizes: dict[str, int]) -> None:
    """Time and flags have 4 bytes, and what has more than 32 bits 8; a record is filled up to a power of two."""
    found = described({**BASE, "clock": "48MHz", "tick": "20us", "max-time": "10ms", "stream": "axi"} | words)
    stream, widths = found["stream"]["dtype"], {port["name"]: port["width"] for port in found["ports"]}
    formats = dict(zip(stream["names"], stream["formats"], strict=True))
    assert formats == {"time": "<u4", "flags": "<u4"} | {name: f"<i{size}" for name, size in sizes.items()}
    assert all(4 + 4 * (widths[name] > 32) == size for name, size in sizes.items())
    places = [0, *accumulate(int(one[-1]) for one in stream["formats"])]
    assert (stream["offsets"], stream["itemsize"]) == (places[:-1], 1 << math.ceil(math.log2(places[-1])))
    assert (widths["m_axis_tdata"], widths["overruns"]) == (8 * stream["itemsize"], 16)
    assert (found["stream"]["packet"], found["stream"]["when"]) == (256, "update")


# Without an option: what docs/reference/options.md says of it.
USUAL = {
    "decoding": 4, "clock_hz": 48_000_000, "tick_cycles": 960, "max_ticks": 500, "unit": "count/tick", "frac_bits": 16,
    "max_speed": "400rad/s", "position_width": 32, "filter_clocks": 0, "index": False, "index_reset": False,
    "age": False, "bounds": False, "edge_error": 0, "lowpass": None,
}  # fmt: skip
LOOP = {
    "inertia": 0.003, "torque_constant": 0.0603, "kp": 100, "kv": 30, "observer": "40.0rad/s", "current_limit": 20,
    "velocity_filter": "40.0rad/s", "control_period": 960, "synchronised": True, "current_width": 16,
    "loop_multiplier": "serial", "command": "ports", "gains": "fixed",
}  # fmt: skip
TIMED = {"timer": "clock", "bound_decay": True, "paper_exact": False}
TRACK = {"max_ticks": 5000, "frac_bits": 24, "max_memory": None, "multiplier": "auto", "position_fine_bits": 6}


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ("s", {"cancel": True, "reciprocal_source": "serial"}),
        ("s axes=2", {"parallel": False}),
        ("m", {"average": 1}),
        ("t", TIMED),
        ("mt loop=yes", {**TIMED, "min_time": 960, "whole_cycles": False, "loop": LOOP}),
        ("rairan", {"estimate": "n3", "adaptive": None, "bound_decay": True, "paper_exact": False}),
        ("track loop=yes", {**TRACK, "loop": LOOP | {"velocity_filter": None}}),
    ],
)
def test_defaults(described: Found, words: str, wanted: dict[str, object]) -> None:
    method, *more = words.split()
    found = described(
        {"method": method, "ppr": "500", "max-speed": "400rad/s", **dict(word.split("=") for word in more)}
    )
    assert {name: found["parameters"][name] for name in USUAL | wanted} == USUAL | wanted
    if "loop" in wanted:
        assert found["loop"]["current"]["limit"] == 20 / found["loop"]["current"]["amperes_per_lsb"]
