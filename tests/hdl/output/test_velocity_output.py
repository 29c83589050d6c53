"""From native velocity to the unit that is wanted: both boxes against the formula, clock by clock."""

from fractions import Fraction

import numpy as np
import pytest
from amaranth import signed
from amaranth.lib import data
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.output import velocity_output
from tachometry.hdl.output.update import VELOCITIES
from tachometry.spec.formats.velocity_output import VelocityOutput

SERIAL, PIPELINED = velocity_output.SerialVelocityOutput, velocity_output.PipelinedVelocityOutput
MAX_NATIVE = 5 << 8
WIDTH = 12
# Multipliers with many digits, with two negative ones at the low end, of a power of two; and none, to hold only.
RATIOS = [Fraction(2, 13), Fraction(11, 64), Fraction(1, 4), Fraction(3, 16), Fraction(1, 700), Fraction(1)]


def check(serial: bool, ratio: Fraction, width: int = 40, n: int = 150, towards: int = 0) -> None:
    output = VelocityOutput(ratio, MAX_NATIVE, width, bounds=towards != 0)
    field = next(name for name, direction in VELOCITIES.items() if direction == towards)
    latency = output.serial_latency if serial else output.pipelined_latency
    rng = np.random.default_rng(4)
    values = [MAX_NATIVE, -MAX_NATIVE, 1, -1, 0, *rng.integers(-MAX_NATIVE, MAX_NATIVE + 1, n).tolist()]
    # Pipelined: a value in every clock, or now and then. Serial: as soon as the one before is done, or later.
    gaps = (latency if serial else 1) + rng.choice([0, 0, 0, 2], len(values))
    rows: list[dict[str, int]] = []
    for k, (value, gap) in enumerate(zip(values, gaps.tolist(), strict=True)):
        rows += [{"velocity_valid": 1, field: value, "tag": k % 8}, *[{"velocity_valid": 0}] * (gap - 1)]
    layout = data.StructLayout({"velocity": signed(WIDTH), field: signed(WIDTH), "tag": 3})
    box = (SERIAL if serial else PIPELINED)(output, layout)
    names = ["shown.valid", f"shown.p.{field}", "shown.p.tag", "shown.p.velocity_overflow"]
    seen = clock_by_clock(box, [*rows, *[{"velocity_valid": 0}] * (latency + 1)], names)
    starts = np.cumsum(gaps) - gaps
    got = [(k, *list(row.values())[1:]) for k, row in enumerate(seen) if row["shown.valid"]]
    wanted = []
    for k, (value, start) in enumerate(zip(values, starts.tolist(), strict=True)):
        scaled = (value * output.multiplier + output.rounding(towards)) >> output.shift
        held = max(-output.limit, min(output.limit, scaled))
        wanted.append((start + latency, held, k % 8, int(held != scaled and not towards)))
        assert towards * (scaled - value * ratio) >= 0
        assert abs(scaled - value * ratio) < (Fraction(9, 8) if towards else Fraction(9, 16))
    assert got == wanted
    assert any(over for *_, over in wanted) == (output.limit < output.greatest and not towards)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("width", [40, 8])
def test_pipelined(ratio: Fraction, width: int) -> None:
    check(False, ratio, width)


@pytest.mark.parametrize("ratio", RATIOS[:1])
@pytest.mark.parametrize("width", [40, 8])
def test_serial(ratio: Fraction, width: int) -> None:
    check(True, ratio, width)


@pytest.mark.parametrize("ratio", RATIOS)
@pytest.mark.parametrize("towards", only([-1], [-1, 1]))  # up is the mirror of down
@pytest.mark.parametrize("serial", [False, True])
def test_bounds_are_rounded_outward(ratio: Fraction, towards: int, serial: bool) -> None:
    if len(VelocityOutput(ratio, MAX_NATIVE, 40).digits) > 2 or not serial:
        check(serial, ratio, 8, towards=towards)
