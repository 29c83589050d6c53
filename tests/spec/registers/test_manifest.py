"""Which entries a manifest has, and those that depend on nothing but a product."""

import math

import pytest
from support.options import had_by

from tachometry.spec import METHODS, ParameterError, of_texts
from tachometry.spec.registers.manifest import check_module_name, manifest

BASE = {"ppr": "8", "clock": "1MHz", "tick": "20clk", "max-time": "200clk", "frac-bits": "5"}


@pytest.mark.parametrize("method", METHODS)
def test_entries_are_there_where_they_apply(method: str) -> None:
    base = had_by(method, BASE)
    plain = manifest(of_texts(method, base))
    assert ("min_time_cycles" in plain) == (method == "mt")
    assert plain.get("min_time_cycles") == (20 if method == "mt" else None)
    assert "bounds" not in plain
    filtered = manifest(of_texts(method, base | {"lowpass": "100Hz"}))
    assert filtered.keys() == plain.keys() - {"recovery_cycles"}
    assert ("recovery_cycles" in plain) == (method != "track")  # which forgets gradually
    for port in ("acceleration", "position_fine"):
        assert (port in plain) == (method == "track")
    if not METHODS[method].facts.own_ticks:
        external = manifest(of_texts(method, base | {"external-tick": "yes"}))
        assert external.keys() == plain.keys() | {"external_tick_cycles"}
        assert external["external_tick_cycles"]["max"] == 2 * int(base["tick"].removesuffix("clk"))
        assert external["latency_cycles"]["tick_in_to_window_end"] == 2


@pytest.mark.parametrize("method", [name for name, spec in METHODS.items() if spec.facts.bounds])
def test_bounds_are_there_where_they_apply(method: str) -> None:
    spec = of_texts(method, BASE | {"bounds": "yes"})
    bounded = manifest(spec)
    assert bounded.keys() == manifest(of_texts(method, BASE)).keys() | {"bounds"}
    assert bounded["bounds"] == {"none": 2 ** (spec.velocity.bound_width - 1) - 1}


def test_tracking_has_no_bounds() -> None:
    assert [name for name, spec in METHODS.items() if not spec.facts.bounds] == ["track"]
    with pytest.raises(ParameterError, match=r"^bounds must not be given with method track"):
        of_texts("track", had_by("track", BASE) | {"bounds": "yes"})


def test_acceleration_and_fine_position() -> None:
    """An LSB of the acceleration: 2^−F of a count per tick², or of the unit of the velocity per second."""
    base = had_by("track", BASE | {"position-fine-bits": "3"})
    count = 2 * math.pi / 32
    tick = int(base["tick"].removesuffix("clk")) / 1e6
    units = {
        "count/tick": ("count/tick²", count / tick**2),
        "rad/s": ("rad/s²", 1),
        "rev/s": ("rev/s²", 2 * math.pi),
        "rpm": ("rpm/s", math.pi / 30),
    }
    for unit, (own, one) in units.items():
        texts = {name: text for name, text in base.items() if name != "frac-bits"} | {"unit": unit}
        described = manifest(of_texts("track", texts))
        acceleration = described["acceleration"]
        assert acceleration["unit"] == own
        assert acceleration["width"] == 32
        assert acceleration["rad_per_s2_per_lsb"] == pytest.approx(one * 0.5 ** acceleration["frac_bits"], rel=1e-12)
        assert described["position_fine"] == {"frac_bits": 3}


@pytest.mark.parametrize("name", ["a", "_", "A9_", "a" * 64])
def test_names_of_modules(name: str) -> None:
    check_module_name(name)


@pytest.mark.parametrize("name", ["", "9a", "a-b", "a" * 65, "module", "ä"])
def test_what_is_no_name_of_a_module(name: str) -> None:
    with pytest.raises(ValueError, match="must "):
        check_module_name(name)
