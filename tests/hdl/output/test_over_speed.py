"""The trip of the speed, clock by clock, and in cores against their golden model."""

from support.simulate import clock_by_clock

from tachometry.hdl.output import over_speed


def test_every_velocity() -> None:
    """Every velocity of six bits, with and without its strobe."""
    rows = [
        {"velocity": velocity, "velocity_valid": valid, "clear": clear}
        for velocity in range(-32, 32)
        for valid, clear in ((0, 0), (1, 0), (0, 0), (0, 1), (0, 0), (1, 1), (0, 0))
    ]
    seen = clock_by_clock(over_speed.OverSpeed(20, 6), rows, ["over_speed"])
    tripped = 0
    for clock, row in enumerate(rows):
        assert seen[clock]["over_speed"] == tripped, (clock, row)
        tripped = int(not row["clear"] and (tripped or (row["velocity_valid"] and abs(row["velocity"]) > 20)))
