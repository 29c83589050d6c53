"""The greatest velocity that a core shows, from a shaft that is faster than it can measure."""

import numpy as np
import pytest
from support.options import had_by

from tachometry.sim import golden
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import METHODS, ParameterError, TachometerSpec, of_texts
from tachometry.spec.registers.manifest import manifest

CORE = {"ppr": "25", "clock": "1MHz", "tick": "16clk", "max-time": "160clk"}
RAD_PER_S = {"rpm": 2 * np.pi / 60, "rev/s": 2 * np.pi}
UNITS = ("count/tick", *RAD_PER_S)
OUTPUTS: tuple[dict[str, str], ...] = (
    {},
    {"unit": "rpm"},
    {"unit": "rev/s", "velocity-width": "14"},
    {"velocity-width": "20"},
    {"velocity-width": "9", "frac-bits": "8"},
)


def spec_of(**options: str) -> TachometerSpec:
    """Return 6.25 rev/s are a count per tick."""
    texts = CORE | {"tick": "1600clk", "max-time": "16000clk"}
    return of_texts("s", texts | {name.replace("_", "-"): text for name, text in options.items()})


def fastest(sign: int, n_clocks: int) -> PinTrace:
    """Return a count in every clock."""
    level = quadrature(sign * np.arange(n_clocks))
    return PinTrace(np.arange(n_clocks), level & np.uint8(1), level >> np.uint8(1), n_clocks)


@pytest.mark.parametrize("options", OUTPUTS, ids=str)
@pytest.mark.parametrize("method", METHODS)
def test_full_scale_is_where_the_velocity_saturates(method: str, options: dict[str, str]) -> None:
    limits = {} if "frac-bits" in options else {"max-speed": "60000rpm"}
    own = {"estimate": "n1"} if method == "rairan" else {}
    spec = of_texts(method, had_by(method, CORE | limits | options | own))
    described = manifest(spec)["velocity"]
    for sign in (1, -1):
        velocity = golden.run(spec, fastest(sign, 40 * spec.timing.tick_cycles)).updates.velocity
        greatest = (sign * velocity).max()
        assert greatest == spec.velocity.full_scale
        assert greatest * 2.0**-spec.velocity.frac_bits == described["full_scale"]
    count = 2 * np.pi / 100 / float(spec.timing.tick_seconds)
    assert described["full_scale_rad_per_s"] == pytest.approx(
        described["full_scale"] * (RAD_PER_S | {"count/tick": count})[spec.unit]
    )


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("width", [12, 18, 27])
def test_the_default_lsb_is_the_finest_with_which_nothing_saturates(unit: str, width: int) -> None:
    spec = spec_of(unit=unit, velocity_width=str(width), max_speed="300rev/s")
    greatest = {"count/tick": 48, "rpm": 18000, "rev/s": 300}[unit]
    fits = [bits for bits in range(-8, 25) if greatest * 2.0**bits <= 2 ** (width - 1) - 1]
    assert spec.velocity.frac_bits == min(fits[-1], 16 if unit == "count/tick" else 10)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"unit": "rpm", "frac_bits": "10", "velocity_width": "18"}, "2^-5 rpm to show 4000rpm in 18 bits, not 2^-10"),
        ({"velocity_width": "12", "frac_bits": "16"}, "must be at most 7 to show 4000rpm in 12 bits, not 16"),
        ({"unit": "rev/s", "frac_bits": "9", "velocity_width": "16"}, "2^-8 rev/s to show 4000rpm in 16 bits"),
    ],
)
def test_an_lsb_that_cannot_show_the_greatest_speed_is_refused(options: dict[str, str], message: str) -> None:
    with pytest.raises(ParameterError) as refused:
        spec_of(max_speed="4000rpm", **options)
    assert message in str(refused.value)
    fitting = options | {"frac_bits": message.split("2^-")[1].split()[0] if "2^" in message else "7"}
    spec_of(max_speed="4000rpm", **fitting)


def test_a_width_that_no_lsb_fits_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"^velocity_width must be at least 16 to show 1000000rpm in count/tick$"):
        spec_of(max_speed="1e6rpm", velocity_width="8")
    spec_of(max_speed="1e6rpm", velocity_width="16")
