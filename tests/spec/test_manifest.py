"""Which entries a manifest has, and those that depend on nothing but a product."""

import pytest

from tachometry.spec import METHODS, of_texts
from tachometry.spec.manifest import check_module_name, manifest

BASE = {"ppr": "8", "clock": "1MHz", "tick": "20", "max-time": "200", "frac-bits": "5"}


@pytest.mark.parametrize("method", METHODS)
def test_entries_are_there_where_they_apply(method: str) -> None:
    plain = manifest(of_texts(method, BASE))
    bounded = manifest(of_texts(method, BASE | {"bounds": "yes"}))
    assert ("min_time_cycles" in plain) == (method == "mt")
    assert plain.get("min_time_cycles") == (20 if method == "mt" else None)
    assert plain.keys() | {"bounds"} == bounded.keys()
    assert "bounds" not in plain
    spec = of_texts(method, BASE | {"bounds": "yes"})
    assert bounded["bounds"] == {"none": 2 ** (spec.bound_width - 1) - 1}
    filtered = manifest(of_texts(method, BASE | {"lowpass": "100Hz"}))
    assert filtered.keys() == plain.keys() - {"recovery_cycles"}
    if not METHODS[method].own_ticks:
        external = manifest(of_texts(method, BASE | {"external-tick": "yes"}))
        assert external.keys() == plain.keys() | {"external_tick_cycles"}
        assert external["external_tick_cycles"]["max"] == 40
        assert external["latency_cycles"]["tick_in_to_window_end"] == 2


def test_full_scale() -> None:
    """Twenty counts a tick, in LSB of 2^−5 count."""
    velocity = manifest(of_texts("m", BASE))["velocity"]
    assert velocity["full_scale"] == 20
    assert velocity["frac_bits"] == 5


@pytest.mark.parametrize("name", ["a", "_", "A9_", "a" * 64])
def test_names_of_modules(name: str) -> None:
    check_module_name(name)


@pytest.mark.parametrize("name", ["", "9a", "a-b", "a" * 65, "module", "ä"])
def test_what_is_no_name_of_a_module(name: str) -> None:
    with pytest.raises(ValueError, match="must "):
        check_module_name(name)
