"""`auto` takes the best method that there can be, and says why."""

import json
from pathlib import Path

import pytest

from tachometry.spec import AUTO, ParameterError, methods_with, of_manifest, of_options, of_texts
from tachometry.spec.core.timing import whole_clocks
from tachometry.spec.language.units import next_written_time, written_time
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import RegisterMap

PPR = {"ppr": "500", "max-speed": "400rad/s"}
# Clocks of its program, serial and with multipliers of the FPGA.
SERIAL, BLOCK = (of_texts("track", PPR | {"multiplier": kind}).latency.busy for kind in ("serial", "block"))
# Ticks for one, two and four turns of the block program on each machine: a turn has a clock more than the program, the
# machines begin two clocks apart, and a round is left.
TURNS = (turns * (BLOCK + 1) + (4 // turns - 1) * 2 + 4 for turns in (1, 2, 4))
ONE, TWO, FOUR = (next_written_time(-(-clocks // 4) * 4, 48_000_000) for clocks in TURNS)

LEAST = written_time(-(-(BLOCK + 11) // 4) * 4, 48_000_000)  # of whole rounds of four slots


def clocks(tick: str) -> int:
    """Return the clocks of a tick at 48 MHz."""
    return whole_clocks("tick", tick, 48_000_000)


CHOICES = [
    ({}, "track", f"as its {SERIAL} clocks fit the tick of 960 clocks"),
    ({"tick": "10us"}, "track", f"as its {BLOCK} clocks fit the tick of 480 clocks"),
    ({"tick": "10us", "external-tick": "yes"}, "track", f"as its {BLOCK} clocks fit the tick of 480 clocks"),
    ({"tick": "5us"}, "mt", f"as track needs a tick of {BLOCK} clocks"),
    ({"tick": "250ns"}, "s", f"as track needs a tick of {BLOCK} clocks and mt needs a tick of 20 clocks"),
    ({"axes": "4", "tick": ONE}, "s", f"as track needs 4 machines or --tick {TWO} and mt is of one axis"),
    ({"axes": "4", "tick": TWO}, "track", f"as the turns of 4 axes fit the tick of {clocks(TWO)} clocks"),
    ({"axes": "4", "tick": FOUR}, "track", f"as the turns of 4 axes fit the tick of {clocks(FOUR)} clocks"),
    ({"axes": "32"}, "track", "as the turns of 32 axes fit the tick of 4800 clocks"),
    ({"axes": "4", "tick": "5us"}, "s", f"as track needs --tick {LEAST} and mt is of one axis"),
    ({"axes": "64", "clock": "12MHz"}, "s", "as track needs 10 machines or --tick 704us and mt is of one axis"),
    ({"bounds": "yes"}, "mt", "as it has --bounds"),
    ({"bounds": "yes", "tick": "250ns"}, "s", "as mt needs a tick of 23 clocks"),
    ({"max-memory": "5ms"}, "track", "as it has --max-memory"),
    ({"timer": "tick"}, "mt", "as it has --timer"),
    ({"paper-exact": "yes"}, "mt", "as it has --paper-exact"),
    ({"paper-exact": "yes", "estimate": "n1"}, "rairan", "as it has --paper-exact"),
    ({"dt": "20us"}, "rairan", "as it has --dt"),
    ({"average": "8"}, "m", "as it has --average"),
    ({"cancel": "no"}, "s", "as it has --cancel"),
    ({"unit": "rpm", "lsb": "2^-11"}, "track", f"as its {SERIAL} clocks fit the tick of 960 clocks"),
]


@pytest.mark.parametrize(("texts", "method", "why"), CHOICES)
def test_what_is_taken_and_why(texts: dict[str, str], method: str, why: str) -> None:
    spec = of_options(PPR | texts)
    assert (spec.method, spec.tachometer.chosen) == (method, why)
    named = of_options(PPR | texts | {"method": method})
    assert spec == named
    assert named.tachometer.chosen == ""


def test_a_manifest_says_that_it_was_chosen(tmp_path: Path) -> None:
    """The core of the manifest is the same, whatever would be chosen by then, and so is its hash for drivers."""
    spec, named = (of_texts(method, PPR) for method in (AUTO, "track"))
    described = manifest(spec)
    assert described["options"].items() >= {"method": "track", "method-chosen": spec.chosen}.items()
    path = tmp_path / "tachometer.json"
    path.write_text(json.dumps(described), encoding="utf-8")
    assert manifest(of_manifest(path)) == described
    assert "method-chosen" not in manifest(named)["options"]
    assert RegisterMap(spec).configuration == RegisterMap(named).configuration


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (
            {"average": "8", "cancel": "no"},
            "cancel must not be given together with --average: no method has all of them",
        ),
        ({"nix": "1"}, "nix must not be given with method s: there is no such option"),
        ({"tick": "0us"}, "tick must be longer than 0, not 0us"),
        ({"filter": "101ms"}, "filter_clocks must be from 0 to 4800000 clocks, 100ms, .*"),
        ({"max-memory": "1ns"}, "max_memory must be a whole number of clocks, .*"),
    ],
)
def test_what_no_method_can_be(texts: dict[str, str], message: str) -> None:
    with pytest.raises(ParameterError, match=f"^{message}"):
        of_options(PPR | texts)


def test_what_it_is_for_decides() -> None:
    def without_acceleration(spec: object) -> None:
        if getattr(spec, "method", "") == "track":
            raise ParameterError("method", "must be another")

    assert of_texts(AUTO, PPR, without_acceleration).chosen == "as track refuses: method must be another"
    assert methods_with("max-memory") == ["track"]


TICKS = [
    ({"clock": "48MHz"}, "track", 960),
    ({"clock": "12MHz"}, "track", 300),  # 25 µs: 260 clocks with multipliers
    ({"clock": "12.288MHz"}, "track", 1536),  # of 20 µs no whole number
    ({"clock": "1.2MHz"}, "track", 300),  # 250 µs
    ({"clock": "200kHz"}, "s", 4),  # track would need 2 ms
    ({"clock": "12MHz", "method": "s"}, "s", 240),
    ({"clock": "12MHz", "method": "track", "multiplier": "serial"}, "track", 1200),
    ({"axes": "32"}, "track", 4800),
    ({"axes": "8"}, "track", 1200),
    ({"clock": "12MHz", "axes": "32", "tick": "40us"}, "s", 480),
    ({"clock": "12MHz", "tick": "20us"}, "mt", 240),
]


@pytest.mark.parametrize(("texts", "method", "tick"), TICKS)
def test_without_a_tick_it_is_as_long_as_the_method_needs(texts: dict[str, str], method: str, tick: int) -> None:
    spec = of_options(PPR | texts)
    assert (spec.method, spec.timing.tick_cycles) == (method, tick)


@pytest.mark.parametrize(
    ("texts", "ticks"),
    [
        ({"tick": "30us"}, 3334),  # track: 100 ms
        ({"tick": "6us", "method": "track"}, 16667),
        ({"tick": "30us", "method": "s"}, 334),
        ({"tick": "20ms", "method": "s"}, 2),
        ({"tick": "1ns", "clock": "1GHz", "method": "s"}, 1 << 20),
    ],
)
def test_a_maximum_time_that_nobody_gave_fits_every_tick(texts: dict[str, str], ticks: int) -> None:
    spec = of_options(PPR | texts)
    assert spec.timing.max_ticks == ticks
    assert of_options(spec.options).timing == spec.timing


@pytest.mark.parametrize(
    ("texts", "same"),
    [
        ({"lines": "500"}, {"ppr": "500"}),
        ({"cpr": "2000"}, {"ppr": "500"}),
        ({"cpr": "1000", "decoding": "2"}, {"ppr": "500", "decoding": "2"}),
        ({"ppr": "500", "pwm": "10kHz"}, {"ppr": "500", "tick": "100us"}),
        ({"ppr": "500", "tick": "10kHz"}, {"ppr": "500", "tick": "100us"}),
        ({"ppr": "500", "tick": "0.05MHz"}, {"ppr": "500"}),
    ],
)
def test_other_names_of_one_thing(texts: dict[str, str], same: dict[str, str]) -> None:
    assert of_texts(AUTO, texts) == of_texts(AUTO, same)
    assert of_texts(AUTO, texts).options == of_texts(AUTO, same).options


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        ({"cpr": "2001"}, "cpr must be a multiple of 4, the counts of a line, not 2001: .* type --lines 2001"),
        ({"cpr": "0"}, "cpr must be from 4 to 16777216, not 0"),
        ({"ppr": "500", "cpr": "2000"}, "cpr must not be given together with --ppr"),
        ({}, "ppr must be given, or --lines, or --cpr"),
        ({"ppr": "5", "pwm": "0Hz"}, "pwm must be greater than 0, not 0Hz"),
        ({"ppr": "5", "pwm": "7kHz"}, "pwm must be a whole number of clocks, not 7kHz .* nearest: --tick 6857clk .*"),
        ({"ppr": "5", "pwm": "10kHz", "tick": "100us"}, "pwm must not be given together with --tick"),
    ],
)
def test_messages_name_what_was_given(texts: dict[str, str], message: str) -> None:
    with pytest.raises(ParameterError, match=f"^{message}"):
        of_texts("s", texts)
