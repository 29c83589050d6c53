"""The cores that are tried: every option of every method, every unit, and the ends of every range."""

from collections.abc import Container, Iterable
from dataclasses import dataclass
from typing import Any

import pytest
from reference.settings import Settings

_PLAIN = {"ppr": "500", "clock": "1000000Hz"}


@dataclass(frozen=True)
class Case:
    """A core, and what its motion must keep from.

    - `clocks`: Length of the motion; a rest of three times the maximum time follows.
    - `least`, `turns`, `within`: See `stimulus.motion`.
    - `seed`: Of its random numbers; the name if it is empty.
    """

    name: str
    settings: Settings
    clocks: int
    least: int = 1
    turns: bool = True
    within: int = 0
    seed: str = ""


def parameters(cases: Iterable[Case], nightly: Container[str] = ()) -> list[Any]:
    """Return cases as parameters of a test; those of the names in `nightly` are only in `make test-all`."""
    mark = pytest.mark.nightly
    return [pytest.param(case, id=case.name, marks=mark if case.name in nightly else ()) for case in cases]


def _case(
    name: str, words: str, clocks: int = 6000, least: int = 1, turns: bool = True, within: int = 0, seed: str = ""
) -> Case:
    """Return a case of words such as `tick=40 index=yes`; its name begins with that of the method."""
    given = dict(word.split("=") for word in words.split())
    return Case(name, Settings(name.split("_")[0], {**_PLAIN, **given}), clocks, least, turns, within, seed)


_PORTS = "decoding=2 unit=rpm index=yes index-reset=yes position-width=8 filter=3 age=yes"
_PORTS += " health=yes health-edges=3 health-errors=1 over-speed=20rpm position-compare=-1:2:9:7clk:backward"
_ALL = f"{_PORTS} bounds=yes"

CASES = [
    _case("s_native", "tick=50 max-time=500 frac-bits=8 velocity-width=10"),
    _case("s_rpm", f"tick=20 max-time=300 max-speed=500rpm velocity-width=18 lsb=2^-8 cancel=no {_ALL}", least=4),
    _case(
        "s_rad", "tick=160 max-time=1600 decoding=1 unit=rad/s lowpass=1kHz external-tick=yes reciprocal=table", 14000
    ),
    _case("s_rev", "tick=1 max-time=2 unit=rev/s lsb=2^-4 bounds=yes", 2000),
    _case(
        "s_two", "tick=2 max-time=6 frac-bits=24 position-width=48 bounds=yes edge-error=0.3 max-speed=50000rad/s", 2500
    ),
    _case(
        "s_filter", "tick=30 max-time=210 filter=255 frac-bits=4 external-tick=yes max-tick-period=37", 20000, least=200
    ),
    _case("m_native", "tick=50 max-time=500 velocity-width=16 max-speed=50rev/s bounds=yes edge-error=1 average=8"),
    _case(
        "m_rpm",
        f"tick=21 max-time=420 max-speed=40rad/s average=3 velocity-width=12 lsb=2^-2 {_ALL} "
        "position-compare=-1:2:9:7clk:both",
        4000,
        least=4,
    ),
    _case("m_rad", "tick=160 max-time=1600 decoding=1 unit=rad/s lowpass=300Hz external-tick=yes average=2", 15000),
    _case("m_rev", "tick=1 max-time=2 unit=rev/s frac-bits=2 average=256", 1500),
    _case("t_native", "tick=50 max-time=500 bounds=yes edge-error=0.5", 9000),
    _case("t_rpm", f"tick=200 max-time=1000 max-speed=4rev/s velocity-width=14 lsb=2^-5 {_ALL}", 13500, 4, True, 80),
    _case("t_rad", "tick=400 max-time=1200 decoding=1 unit=rad/s lowpass=1kHz external-tick=yes", 24000, 1, True, 150),
    _case("t_rev", "tick=256 max-time=512 unit=rev/s lsb=2^-8 bound-decay=no", 20000, 1, True, 100),
    _case("t_lattice", "tick=37 max-time=740 timer=tick bounds=yes frac-bits=9", 9000),
    _case("t_exact", "tick=2 max-time=400 paper-exact=yes frac-bits=24", 5000),
    _case("mt_native", "tick=50 max-time=500 bounds=yes edge-error=0.1 min-time=101", 9000),
    _case(
        "mt_rpm",
        f"tick=200 max-time=1000 max-speed=125rpm velocity-width=14 lsb=2^-6 min-time=350 {_ALL}",
        13500,
        4,
        True,
        80,
    ),
    # With one count a cycle, all windows are whole cycles anyway.
    _case(
        "mt_rad",
        "tick=400 max-time=1200 decoding=1 unit=rad/s lowpass=100rad/s external-tick=yes whole-cycles=yes",
        24000,
        1,
        True,
        150,
    ),
    _case("mt_rev", "tick=256 max-time=512 unit=rev/s lsb=2^-8 bound-decay=no min-time=512", 20000, 1, True, 100),
    _case(
        "mt_lattice",
        "tick=50 max-time=500 timer=tick min-time=100 external-tick=yes frac-bits=8 bounds=yes edge-error=0.25",
        12000,
    ),
    _case("mt_exact", "tick=1 max-time=300 paper-exact=yes frac-bits=24 min-time=10", 5000),
    _case("rairan_native", "dt=50 max-time=500 bounds=yes edge-error=0.7", 12000),
    _case(
        "rairan_rpm", f"tick=30 max-time=600 max-speed=100rad/s velocity-width=14 lsb=2^-3 estimate=n1 {_ALL}", 12000, 4
    ),
    _case(
        "rairan_rad",
        "tick=400 max-time=4000 decoding=1 unit=rad/s lowpass=1kHz estimate=n2 bound-decay=no",
        30000,
        least=130,
        seed="rairan_rad6",  # with updates so far apart that the filter takes them all
    ),
    _case("rairan_rev", "tick=20 max-time=1280 unit=rev/s lsb=2^-6 adaptive=10% bounds=yes", 14000),
    _case("rairan_one", "dt=1 max-time=2047 decoding=2 unit=rpm max-speed=1rev/s velocity-width=20", 3000),
    _case("rairan_exact", "tick=17 max-time=340 paper-exact=yes estimate=n1 frac-bits=24", 9000),
    _case("track_native", "tick=1250 max-time=12500 age=yes frac-bits=16", 120_000),
    _case(
        "track_rpm",
        "tick=1200 max-time=7200 max-speed=100rpm velocity-width=14 lsb=2^-4 max-memory=96000 multiplier=serial "
        f"position-fine-bits=4 {_PORTS}",
        60_000,
        4,
        seed="track_rpm2",  # with more counts in a tick than may be
    ),
    _case(
        "track_rad",
        "tick=1100 max-time=11000 decoding=1 unit=rad/s lowpass=100rad/s external-tick=yes position-fine-bits=1 "
        "lsb=2^-8 multiplier=block",
        120_000,
    ),
    _case(
        "track_rev",
        "tick=1500 max-time=6000 unit=rev/s lsb=2^-10 velocity-width=12 external-tick=yes max-tick-period=2000 "
        "position-fine-bits=16",
        120_000,
        seed="track_rev1",  # with a speed that does not fit, and a rest
    ),
]
# Cores with a tick of 50 clocks and a maximum time of 10 ticks, which test_silence.py plays more on.
SILENT = [case for case in CASES if case.name.endswith("_native") or case.name == "mt_lattice"]
# Cores of which only the manifest is of interest.
DESCRIBED = [
    # The greatest speed is less than 2^-10 of its unit.
    _case("s_slow", "ppr=4194304 tick=1048576 max-time=2097152 unit=rpm max-speed=0.0001rpm"),
    _case(
        "t_fast",
        "ppr=1 tick=2 max-time=4096 unit=rad/s timer=tick external-tick=yes max-tick-period=9 max-speed=1e5rpm "
        "velocity-width=24",
    ),
    _case("mt_default", "tick=50 max-time=1000 external-tick=yes filter=129 bounds=yes unit=rpm"),
    _case(
        "mt_raised",  # both of its times, as they are shorter than a division
        "tick=4 max-time=8 external-tick=yes max-tick-period=60 bounds=yes edge-error=0.6 timer=tick",
    ),
]
# What takes millions of clocks.
LONG = [
    _case("s_long_tick", "tick=1048576 max-time=2097152 unit=rpm lsb=2^-12 velocity-width=64 bounds=yes"),
    _case("s_long_time", "tick=1 max-time=1048576 frac-bits=24"),
]
