"""Reads settings of the emulator as people write them."""

import pytest

from tachometry.boards.monitor.emulator_settings import emulator_settings
from tachometry.spec import of_texts
from tachometry.spec.registers.emulator import fastest, rad_per_s, rate_of

SPEC = of_texts("m", {"ppr": "500", "clock": "12MHz"})


@pytest.mark.parametrize(
    ("words", "fields"),
    [
        ([], {}),
        (["source=pins"], {"emulated": 0}),
        (["source=emulator"], {"emulated": 1}),
        (["acceleration=500rad/s2"], {"rate": rate_of(SPEC, 500)}),
        (["acceleration=500"], {"rate": rate_of(SPEC, 500)}),
        (["acceleration=500rad/s^2"], {"rate": rate_of(SPEC, 500)}),
        (["acceleration=60rpm/s"], {"rate": rate_of(SPEC, 6.283185307179586)}),
        (["phase-error=5%", "duty-a=-0.05", "duty-b=36deg"], {"phase_error": 51, "duty_a": -51, "duty_b": 102}),
        (["jitter=0"], {"jitter": 0}),
        (["jitter=1%"], {"jitter": 7}),
        (["jitter=6%"], {"jitter": 63}),
        (["bounce=5us"], {"bounce": 60}),
        (["bounce=7"], {"bounce": 7}),
        (["drop=1%"], {"drop": 3}),
        (["glitches=0.1%", "broken=b,z", "stuck=none"], {"glitches": 66, "broken": 6, "stuck": 0}),
    ],
)
def test_values(words: list[str], fields: dict[str, int]) -> None:
    assert emulator_settings(SPEC, words) == fields


@pytest.mark.parametrize("text", ["100rad/s", "100", "954.929658551372rpm", "15.91549430918953rev/s"])
def test_speeds(text: str) -> None:
    found = emulator_settings(SPEC, [f"speed={text}"])
    assert found["emulated"] == 1
    assert rad_per_s(SPEC, found["speed"]) == pytest.approx(100, rel=1e-5)
    assert emulator_settings(SPEC, [f"speed=-{text}"])["speed"] == -found["speed"]
    assert emulator_settings(SPEC, [f"speed={text}", "source=pins"])["emulated"] == 0
    assert emulator_settings(SPEC, ["source=pins", f"speed={text}"])["emulated"] == 0


def test_the_fastest_speed_is_taken() -> None:
    most = fastest(SPEC)
    assert emulator_settings(SPEC, [f"speed={most}"])["speed"] == 1 << 29
    assert emulator_settings(SPEC, [f"speed=-{most}"])["speed"] == -(1 << 29)


@pytest.mark.parametrize(
    ("word", "message"),
    [
        ("speed", "--set must be NAME=VALUE with a NAME of speed, acceleration, phase-error, duty-a, duty-b, jitter, "),
        ("spin=1", "--set must be NAME=VALUE with a NAME of "),
        ("", "--set must be NAME=VALUE with a NAME of "),
        ("speed=fast", "--set speed must be a number in rad/s, rev/s, rpm (default rad/s), not 'fast'"),
        ("speed=nan", "--set speed must be a number in "),
        ("speed=1e6", "--set speed must be from -18849.5 to 18849.5 rad/s with this clock, not 1e6"),
        ("speed=1e999", "--set speed must be of a size from 1e-30 to 1e30"),
        ("acceleration=0", "--set acceleration must be from 0.003214 to 1.381e+07 rad/s/s here"),
        ("acceleration=-1", "--set acceleration must be from 0.003214 to 1.381e+07 rad/s/s here"),
        ("acceleration=1e12", "--set acceleration must be from 0.003214 to 1.381e+07 rad/s/s here"),
        ("phase-error=13%", "--set phase-error must be from -12.5% to 12.4%, not 13%"),
        ("duty-a=-13%", "--set duty-a must be from -12.5% to 12.4%, not -13%"),
        ("jitter=7%", "--set jitter must be from 0% to 6.152%, not 7%"),
        ("jitter=-1%", "--set jitter must be from 0% to 6.152%, not -1%"),
        ("bounce=1ms", "--set bounce must be from 0 to 255 clocks, 21.25us, not 1ms"),
        ("drop=100%", "--set drop must be from 0% to 99.61%, not 100%"),
        ("glitches=1%", "--set glitches must be from 0% to 0.3891%, not 1%"),
        ("broken=c", "--set broken must be none, or of a, b, z, with commas between, not 'c'"),
        ("source=motor", "--set source must be pins or emulator, not 'motor'"),
    ],
)
def test_what_cannot_be_set_is_refused(word: str, message: str) -> None:
    with pytest.raises(ValueError, match=r"^--set ") as refused:
        emulator_settings(SPEC, [word])
    assert str(refused.value).startswith(message)
