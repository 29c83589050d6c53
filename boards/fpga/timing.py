"""Judges whether a routed design is fast enough, as nextpnr reports it.

nextpnr counts arcs to block RAMs of Gowin several times (its issue #1803), and calls paths violations of hold times
that by its own sums are none. So it is told not to judge, and what it lists is judged here: a violation is one if its
path, as listed, has less time than it must have.
"""

import re
from collections.abc import Mapping
from typing import Any

_COUNTED = re.compile(r"^Info: (\d+) Hold/min time violations", re.MULTILINE)
_LISTED = re.compile(r"^(?:Warning|ERROR): Hold/min time violation for (.+):$")
# The last step of a path: what the hold time takes, and what is left.
_LEFT = re.compile(r"^Info: +hold +-?\d+\.\d+ +(-?\d+\.\d+) +Source (\S+)$")
_NEAR = 1e-4  # nextpnr keeps periods in picoseconds


class TimingError(ValueError):
    """The design is not fast enough, or nothing says that it is."""


def slowest_clock(report: Mapping[str, Any], clock_hz: int) -> float:
    """Return Fmax in MHz of the slowest clock in a report of nextpnr.

    It raises TimingError if a clock is too slow, or was held against another frequency than this, or there is none.
    """
    clocks: Mapping[str, Mapping[str, float]] = report.get("fmax", {})
    if not clocks:
        raise TimingError("nextpnr must have checked a clock, and has checked none")
    wanted = clock_hz / 1e6
    for name, clock in clocks.items():
        if clock["constraint"] < wanted * (1 - _NEAR):
            raise TimingError(f"{name} must be checked at {wanted:g} MHz, not {clock['constraint']:g} MHz")
        if clock["achieved"] < wanted:
            raise TimingError(f"timing is not met: {name} is good for {clock['achieved']:.2f} MHz, not {wanted:g} MHz")
    return min(clock["achieved"] for clock in clocks.values())


def check_hold(log: str) -> None:
    """Check that no data come too early, in a log of nextpnr.

    It raises TimingError if there is a violation that is one, or one that is not listed, or cannot be read.
    """
    counted = sum(map(int, _COUNTED.findall(log)))
    judged = 0
    clock = ""
    for line in log.splitlines():
        if listed := _LISTED.match(line):
            if clock:
                raise TimingError(f"timing is not met: a hold time on {clock}, whose path is not listed")
            clock = listed[1]
        elif clock and (end := _LEFT.match(line)):
            if float(end[1]) < 0:
                raise TimingError(f"timing is not met: data are {-float(end[1]):.2f} ns too early at {end[2]}")
            judged += 1
            clock = ""
    if clock:
        raise TimingError(f"timing is not met: a hold time on {clock}, whose path is not listed")
    if judged < counted:
        raise TimingError(f"timing is not met: of {counted} hold times only {judged} are listed")
