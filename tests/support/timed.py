"""The datapath of a method that measures times, with injected steps and ticks."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from reference.sequences import rounded

from support.simulate import clock_by_clock
from tachometry.hdl.methods import DATAPATHS
from tachometry.spec import METHODS, Encoder, Timing
from tachometry.spec.methods.timed import TimedTachometer

OUTPUTS = ["velocity_valid", "velocity", "interval", "forced"]
TICK, MAX_TICKS, FRAC_BITS = 20, 20, 8
SILENCE = TICK * MAX_TICKS  # clocks after which a 0 is forced

Row = tuple[int, int, int, bool]  # clock of the cause, velocity, interval, forced


def spec_of(method: str, **options: Any) -> TimedTachometer:
    """Return ticks of 20 clocks, a little more than a division takes, and at most 20 of them."""
    timing = Timing(100 * TICK, TICK, MAX_TICKS)
    spec = METHODS[method](**{"encoder": Encoder(25), "timing": timing, "frac_bits": FRAC_BITS, **options})
    assert isinstance(spec, TimedTachometer)
    return spec


def run(spec: TimedTachometer, counts: Mapping[int, int], n_clocks: int) -> list[Row]:
    """Return all updates; `counts` has the steps by their clocks, or on the lattice the pulse
    numbers by their ticks.
    """
    tick = spec.timing.tick_cycles
    rows = []
    for clock in range(n_clocks + spec.latency.datapath):
        row = {"coming": int(clock % tick == tick - 2)}
        if spec.form.on_lattice:
            row |= {"next_count": counts.get(clock // tick, 0), "pulse_count": counts.get((clock + 1) // tick - 1, 0)}
        else:
            row["step_before"] = counts.get(clock + 1, 0)
        rows.append(row)
    seen = clock_by_clock(DATAPATHS[spec.method](spec), rows, OUTPUTS)
    held = dict.fromkeys(OUTPUTS, 0)
    for row in seen:  # from update to update all outputs stay
        held = row if row["velocity_valid"] else held
        assert {**row, "velocity_valid": 0} == {**held, "velocity_valid": 0}
    return [
        (clock - spec.latency.datapath, row["velocity"], row["interval"], bool(row["forced"]))
        for clock, row in enumerate(seen)
        if row["velocity_valid"]
    ]


def speed(counts: int, clocks: int) -> int:
    """Return raw velocity of some counts in so many clocks."""
    return rounded(Fraction(counts * TICK, clocks), FRAC_BITS)


def decay(last_count: int, velocity: int, until: int) -> list[Row]:
    """Return the updates with which a velocity decays: at ticks without a count, 1½ counts over the time since the
    last.
    """
    rows = []
    for clock in range(last_count + TICK, until):
        if clock % TICK == TICK - 1:
            most = speed(3 if velocity > 0 else -3, 2 * (clock - last_count))
            if abs(most) < abs(velocity):
                velocity = most
                rows.append((clock, most, clock - last_count, True))
    return rows


def silence(last_count: int, until: int) -> list[Row]:
    """Return the zeros that silence forces."""
    ends = range(last_count + SILENCE, until, SILENCE)
    return [(end, 0, SILENCE, True) for end in ends]
