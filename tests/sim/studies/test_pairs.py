"""Configurations of every method in which every two options meet."""

from itertools import combinations, product

import pytest

from tachometry.sim.studies.pairs import apart, configurations, factors, rows, spec_of
from tachometry.spec import METHODS, common_options, own_options

# What cannot be together at all, of every method that has both.
APART = {
    frozenset({("tick", "1"), ("external-tick", "yes")}),
    frozenset({("paper-exact", "yes"), ("bounds", "yes edge-error 0.3")}),
    frozenset({("paper-exact", "yes"), ("adaptive", "25%")}),
    frozenset({("paper-exact", "yes"), ("whole-cycles", "yes")}),
    frozenset({("timer", "tick"), ("whole-cycles", "yes")}),
    *(frozenset({("disc-table", "edges"), other}) for other in (("timer", "tick"), ("cancel", "no"))),
    frozenset({("adaptive", "25%"), ("max-time", "2")}),
    frozenset({("adaptive", "25%"), ("max-time", "3")}),
    frozenset({("adaptive", "25%"), ("lowpass", "20kHz")}),
    *(
        frozenset({("electrical", value), other})
        for value in ("7", "7 electrical-offset 30deg", "7 lead 1.5tick", "7 sincos", "7 sincos-table")
        for other in (("sensor", "hall"), ("tick", "1"), ("tick", "2"), ("tick", "3"))
    ),
    # A period of halls has six counts, and only A and B have a state for the index and edges to miss.
    *(frozenset({("sensor", "hall"), ("decoding", value)}) for value in "12"),
    frozenset({("sensor", "up-down"), ("decoding", "2")}),
    frozenset({("sensor", "hall"), ("whole-cycles", "yes")}),
    *(
        frozenset({("sensor", sensor), (name, value)})
        for sensor in ("hall", "pulses", "step-dir", "up-down")
        for name, value in (
            ("health", "yes"),
            ("health", "yes health-edges 5"),
            ("health", "yes health-errors 0"),
            ("health", "yes differential 2"),
            ("health", "yes differential 40"),
            ("index", "yes index-at A=0,B=1"),
            ("index", "yes index-at A=1,B=1"),
        )
    ),
}


OF_S = {frozenset({("disc-table", "edges"), ("bounds", value)}) for value in ("yes", "yes edge-error 0.3")}


@pytest.mark.parametrize("method", METHODS)
def test_pairs_are_counted(method: str) -> None:
    """Of every two options that are declared, all their values, but for those that are known to be apart."""
    factors_ = [(name, value) for name, values in factors(method).items() for value in values]
    wanted = {frozenset(pair) for pair in combinations(factors_, 2) if pair[0][0] != pair[1][0]}
    met = {frozenset(pair) for row in rows(method) for pair in combinations(row.items(), 2)}
    known = APART | (OF_S if method == "s" else set())
    assert met == wanted - known
    assert len(met) == len(wanted) - len(wanted & known) > 300


@pytest.mark.parametrize("method", METHODS)
def test_what_cannot_be_together_is_known(method: str) -> None:
    assert apart(method) <= APART | (OF_S if method == "s" else set())


def test_the_extremes_are_there() -> None:
    cores = {method: [spec_of(words) for words in configurations(method)] for method in METHODS}
    assert sum(map(len, cores.values())) >= 73

    def values(method: str, *names: str) -> set[tuple[object, ...]]:
        return {tuple(spec.parameters[name] for name in names) for spec in cores[method]}

    assert values("s", "tick_cycles", "max_ticks") == set(product((1, 2, 3, 960), (2, 3, 500, 4096)))
    assert values("s", "index", "index_reset") == {(False, False), (True, False), (True, True)}
    for method in METHODS:
        # Tracking takes hundreds of clocks.
        assert values(method, "tick_cycles") >= ({(960,)} if method == "track" else {(1,), (3,), (960,)})
        widths = [spec for spec in cores[method] if spec.velocity_width is not None]
        assert 0 < len(widths) < len(cores[method])
        assert any(spec.velocity.native_frac_bits == 24 for spec in cores[method])
        assert any(spec.max_speed for spec in cores[method])


@pytest.mark.parametrize("method", METHODS)
def test_every_option_is_a_factor(method: str) -> None:
    """Or a value of one, of every method: what can be in one core alone, and the size of the encoder, are not."""
    found = factors(method)
    assert {about.name for about in own_options(method)} - {"period"} <= set(found)  # it is of reads as well
    without = {about.name for about in common_options() if not about.needs} - set(found)
    never = {"rairan": {"external-tick"}, "track": {"tick", "bounds"}}
    lines = {"pole-pairs", "teeth", "ratio"}  # tests/hdl/front_end has the wheel, tests/spec/core the ratio
    lines |= {
        "bits",
        "sample-age",
        "zero",
        "chip",
        "encoder-clock",
        "line-delay",
        "crc",
        "gray",
        "repeat",
        "period-offsets",
    }  # tests/hdl/core has reads
    lines |= {"disc"} if method in ("t", "mt", "s", "track") else {"disc", "disc-table"}  # tests/extras has maps
    assert without == {"ppr", "lines", "cpr", "clock", "dt", "pwm", "lsb"} | lines | never.get(method, set())
    assert "yes index-reset" in found["index"]
    assert ("yes edge-error 0.3" in found.get("bounds", ())) == METHODS[method].facts.bounds


def test_words_and_specs_are_the_same() -> None:
    for method in METHODS:
        for words in configurations(method):
            spec = spec_of(words)
            assert spec.method == method
            assert ("velocity-width" in f" {words}") == (spec.velocity_width is not None)
