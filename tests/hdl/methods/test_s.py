"""The datapath, with injected ticks."""

from fractions import Fraction

import pytest
from reference.sequences import MAX_TICKS, PAPER, rounded
from support.simulate import clock_by_clock

from tachometry.hdl.methods.s import SMethod
from tachometry.spec import Encoder, Speed, STachometer, Timing

OUTPUTS = ["velocity_valid", "velocity", "interval", "forced"]


def datapath_spec(*, cancel: bool = True, serial: bool = True, frac_bits: int = 16) -> STachometer:
    """Return |m_e| up to 4; the spec takes the serial or the pipelined scaler by the length of a tick."""
    timing = Timing(clock_hz=1_000_000, tick_cycles=16 if serial else 4, max_ticks=MAX_TICKS)
    speed = Speed(Fraction(4_000_000, 100 * timing.tick_cycles), "rev/s")
    spec = STachometer(encoder=Encoder(25), timing=timing, frac_bits=frac_bits, max_speed=speed, cancel=cancel)
    assert (spec.latency.serial, spec.tick.max_count) == (serial, 4)
    return spec


def run(spec: STachometer, m_e: list[int]) -> list[dict[str, int]]:
    """Return the outputs from the first tick on."""
    pause = [{"tick": 0}] * (spec.timing.tick_cycles - 2)
    rows: list[dict[str, int]] = []
    for number in m_e:
        rows += [{"coming": 1, "next_count": number}, {"coming": 0, "tick": 1, "pulse_count": number}, *pause]
    return clock_by_clock(SMethod(spec), rows + [{}] * spec.latency.tick_to_velocity, OUTPUTS)[1:]


def check_paper_sequences(*, cancel: bool = True, serial: bool = True) -> None:
    spec = datapath_spec(cancel=cancel, serial=serial)
    for name, (m_e, updates) in PAPER.items():
        seen = run(spec, m_e)
        got = [(clock, row) for clock, row in enumerate(seen) if row["velocity_valid"]]
        wanted = []
        for tick, m_s, forced, eq17, eq21 in updates:
            velocity = rounded(eq21 if cancel else eq17, spec.velocity.frac_bits)
            wanted.append(
                (
                    tick * spec.timing.tick_cycles + spec.latency.tick_to_velocity,
                    {"velocity_valid": 1, "velocity": velocity, "interval": m_s, "forced": int(forced)},
                )
            )
        assert got == wanted, name


@pytest.mark.parametrize("serial", [True, False])
@pytest.mark.parametrize("cancel", [True, False])
def test_the_papers_sequences(cancel: bool, serial: bool) -> None:
    check_paper_sequences(cancel=cancel, serial=serial)


@pytest.mark.parametrize("serial", [True, False])
def test_outputs_are_held_from_update_to_update(serial: bool) -> None:
    seen = run(datapath_spec(serial=serial), PAPER["3.25 units"][0])
    held = dict.fromkeys(OUTPUTS, 0)
    for row in seen:
        if row["velocity_valid"]:
            held = row
        assert {**row, "velocity_valid": 0} == {**held, "velocity_valid": 0}
