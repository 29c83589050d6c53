"""Over-speed, from the rows that a core shows and the words of the command line alone; see `extras.harness`."""

import math

import pytest
from amaranth.lib import wiring
from amaranth.lib.wiring import In
from extras.harness import Case, agreeing, in_icarus, on_a_bus, refused
from support.simulate import clock_by_clock

from tachometry.hdl.extras import check_inputs
from tachometry.hdl.extras.over_speed import Gates

CASES = (Case("s", "over-speed=2000rad/s"), Case("m", "over-speed=3000rpm unit=rpm"), Case("mt", "over-speed=40000rpm"))


def rule(case: Case) -> None:
    """From the clock after the first velocity beyond the limit on, every tick shows it."""
    text = case.texts["over-speed"]
    unit = "rpm" if text.endswith("rpm") else "rad/s"
    limit = float(text.removesuffix(unit)) * {"rad/s": 1, "rpm": math.pi / 30}[unit]
    tripped = False
    for row in case.rows():
        if row.tick:
            assert row.over_speed == tripped, row
        tripped |= row.velocity_valid and abs(row.rad_per_s) > limit + 1e-9


test_cores = agreeing(CASES, rule)
test_bus = on_a_bus(CASES[0])
test_verilog = in_icarus(CASES[1])
test_refusals = refused(
    {
        "over-speed=1e9rad/s": "over_speed must be less than .* rad/s, the greatest velocity, not 1000000000rad/s",
        "over-speed=fast": "over_speed must be",
    }
)


def test_every_velocity() -> None:
    """Every velocity of six bits, with and without its strobe, and cleared in the same clock."""
    rows = [
        {"velocity": velocity, "velocity_valid": valid, "clear": clear}
        for velocity in range(-32, 32)
        for valid, clear in ((0, 0), (1, 0), (0, 0), (0, 1), (0, 0), (1, 1), (0, 0))
    ]
    tripped = False
    for row, seen in zip(rows, clock_by_clock(Gates(20, 6), rows, ["over_speed"]), strict=True):
        assert seen["over_speed"] == tripped, row
        tripped = not row["clear"] and (tripped or (bool(row["velocity_valid"]) and abs(row["velocity"]) > 20))


def test_an_input_that_nothing_drives_is_an_error() -> None:
    boxes = {"over_speed": wiring.Component({"velocity": In(6), "clear": In(1), "speed": In(1)})}
    with pytest.raises(LookupError, match="over_speed has inputs that nothing drives: speed"):
        check_inputs(CASES[0].spec, boxes, {"velocity"})
