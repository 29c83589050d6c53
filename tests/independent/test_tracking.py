"""Tracking on a motion of which speed, acceleration and place are known in every clock."""

import json
import math
import random
from bisect import bisect_right
from collections.abc import Callable
from fractions import Fraction
from itertools import accumulate, pairwise
from pathlib import Path

import pytest
from independent.bench import Manifest, Row, in_verilator
from independent.cases import CASES, Case
from independent.show import check_velocity
from independent.stimulus import Lines, steady
from reference.front import conditioned, wrapped
from reference.settings import Settings, arguments

TRACKING = [case for case in CASES if case.settings.method == "track"]
FIRST = 5  # ticks before the motion
PART = 800  # ticks of each part of it, in which all that was before is forgotten
SETTLED = 100  # of these, those in which it is
# Clocks from an edge to the next: slow and fast, within the greatest speed and the bits of the velocity.
SPEEDS = {"track_rpm": (3001, 500), "track_rev": (625, 260)}


def ramp(at: int, begin: Fraction, end: Fraction, clocks: int) -> list[tuple[int, int]]:
    """Return edges after a clock, between two speeds in edges per clock, at a constant acceleration."""
    a = (end - begin) / clocks
    times = [(math.sqrt(begin**2 + 2 * a * k) - begin) / a for k in range(1, int((begin + end) / 2 * clocks) + 1)]
    return [(at + round(time), 1) for time in times]


class Motion:
    """A slow speed, up to a fast one, this forward and back, and a rest: played on a core, and what it shows.

    - `slow`, `fast`: Clocks from an edge to the next.
    """

    def __init__(self, settings: Settings, slow: int, fast: int) -> None:
        self.settings = settings
        self.length = PART * settings.tick
        self.begins = [FIRST * settings.tick]
        self.gaps = [slow, 0, fast, -fast]
        self.lines = Lines(0)
        speeds = Fraction(1, slow), Fraction(1, fast)
        self.acceleration = (speeds[1] - speeds[0]) / self.length  # edges per clock²
        for gap in self.gaps:
            at, sign = self.begins[-1], 1 if gap > 0 else -1
            part = steady(at, abs(gap), self.length // abs(gap), sign) if gap else ramp(at, *speeds, self.length)
            self.lines.edges += part
            self.begins.append(part[-1][0])
        self.lines.n_clocks = self.begins[-1] + (settings.max_ticks + 3) * settings.longest_tick
        self.rows: list[Row] = []

    def play(self, folder: Path, manifest: Manifest) -> None:
        """Ticks from outside differ in length."""
        settings, latency = self.settings, manifest["latency_cycles"]
        if settings.external:
            rng, at = random.Random("track"), settings.tick
            while at < self.lines.n_clocks:
                self.lines.pulses.append((at, 3, 1))
                at += rng.randrange(manifest["external_tick_cycles"]["min"], settings.tick * 9 // 8)
        play = self.lines.play()
        rest = latency.get("tick_to_update", latency["tick_to_velocity"]) - latency["tick_to_velocity"]
        rows = in_verilator(folder, [manifest], [play], "update_valid" if rest else "velocity_valid")[0]
        self.rows = [row | {"clock": row["clock"] - rest} for row in rows]  # in which the velocity is shown
        self.late = latency["tick_latency"] + latency["tick_to_velocity"]  # from the end of a tick to its update
        self.delay = latency["pin_to_count"] + self.late
        steps = conditioned(settings, play, latency["pin_to_count"]).steps
        self.counts = sorted(steps)
        self.positions = list(accumulate(steps[clock] for clock in self.counts))

    def settled(self, part: int) -> list[Row]:
        """Return the last updates of a part."""
        begin, end = self.begins[part : part + 2]
        return [row for row in self.rows if begin < row["clock"] < end][-SETTLED:]

    def gap(self, part: int) -> int:
        """Return clocks from a count to the next, with the sign of the direction."""
        return self.gaps[part] * 4 // self.settings.decoding

    def place(self, row: Row, gap: int) -> Fraction:
        """Return counts at the end of the tick of an update: the edge of a count lies half a count before its
        position.
        """
        last = row["clock"] - self.late
        known = bisect_right(self.counts, last) - 1
        sign = 1 if gap > 0 else -1
        return self.positions[known] - Fraction(sign, 2) + Fraction(last - self.counts[known], gap)

    def speed(self, row: Row) -> Fraction:
        """Return on the ramp, in counts per tick, in the clock of an update."""
        edges = Fraction(1, self.gaps[0]) + self.acceleration * (row["clock"] - self.begins[1])
        return edges * self.settings.decoding / 4 * self.settings.tick

    @property
    def real_acceleration(self) -> float:
        """The acceleration of the ramp in rad/s²."""
        settings = self.settings
        per_tick = self.acceleration * settings.decoding / 4 * settings.tick**2
        return float(per_tick * settings.per_count("rad/s") / settings.tick_seconds)


def check_steady(motion: Motion, part: int, per_lsb: float) -> None:
    """All is right to an LSB; there is hardly an acceleration."""
    settings, gap, one = motion.settings, motion.gap(part), 1 << motion.settings.position_fine_bits
    bits = settings.position_bits + settings.position_fine_bits
    for row in motion.settled(part):
        check_velocity(settings, Fraction(settings.tick, gap), row, Fraction(1, 4))
        assert abs(row["acceleration"] * per_lsb) < motion.real_acceleration / 500, row
        off = wrapped(row["position_fine"] - round(motion.place(row, gap) * one), bits)
        assert abs(off) <= 1 + one / 200, row


def check_ramp(motion: Motion, per_lsb: float) -> None:
    """The velocity is that of the clock in which it is shown; a low-pass filter lags."""
    settings = motion.settings
    lsb = 1 / settings.lsb_per_count
    per_tick = motion.acceleration * settings.decoding / 4 * settings.tick**2
    share = 1.0 if settings.lowpass is None else -math.expm1(-float(settings.lowpass * settings.tick_seconds))
    # It is less off than it would be if it were that of some earlier clock.
    most = lsb + per_tick * motion.delay / settings.tick / 20
    settled = motion.settled(1)
    shown = 0.0
    for row in motion.rows[: motion.rows.index(settled[-1]) + 1]:
        shown += share * (float(motion.speed(row)) - shown)
        if row["clock"] >= settled[0]["clock"]:
            assert abs(float(row["velocity"] * lsb) - shown) <= most, row
            assert row["acceleration"] * per_lsb == pytest.approx(motion.real_acceleration, rel=0.002, abs=per_lsb), row


def check_first_counts(motion: Motion) -> None:
    """The first count has no speed; with the second, it is right within 0.4 %."""
    came = [row for row in motion.rows if not row["forced"]]
    assert not any(row["velocity"] for row in motion.rows[: motion.rows.index(came[0]) + 1])
    right = Fraction(motion.settings.tick, motion.gap(0))
    check_velocity(motion.settings, right, came[1], right * motion.settings.lsb_per_count / 250)


def check_rest(motion: Motion) -> None:
    """The speed falls while no count comes, and is 0 after the maximum time."""
    rows = [row for row in motion.rows if row["clock"] - motion.late > motion.counts[-1]]
    speeds = [abs(row["velocity"]) for row in rows]
    assert all(later <= before for before, later in pairwise(speeds))
    assert speeds[0] > speeds[-1]
    silent = motion.settings.max_ticks * motion.settings.tick
    at_rest = [row for row in rows if row["clock"] - motion.late - motion.counts[-1] >= silent]
    assert len(at_rest) > 1
    for row in at_rest:
        assert row["acceleration"] == 0
        assert motion.settings.lowpass is not None or row["velocity"] == 0


# In every tick of a core, test_cores.py has what tracking may show; tests/sim/golden has how well it does.
@pytest.mark.nightly
@pytest.mark.parametrize("case", TRACKING, ids=lambda case: case.name)
def test_a_known_motion(case: Case, generated: Callable[..., Path]) -> None:
    settings = case.settings
    folder = generated(case.name, "--method", "track", *arguments(settings.words))
    manifest = json.loads((folder / f"{case.name}.json").read_text())
    motion = Motion(settings, *SPEEDS.get(case.name, (625, 157)))
    motion.play(folder, manifest)
    per_lsb = manifest["acceleration"]["rad_per_s2_per_lsb"]
    for part in (0, 2, 3):
        check_steady(motion, part, per_lsb)
    check_ramp(motion, per_lsb)
    if settings.lowpass is None:
        check_first_counts(motion)
    check_rest(motion)
