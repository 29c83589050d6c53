"""Every change of the lines of every sensor, against where a data sheet draws them."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from reference.front import CYCLE
from reference.sensors import Decoder, possible
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.decoder import QuadratureDecoder, decoder_of
from tachometry.sim.golden.front_end import looked_up
from tachometry.spec import Encoder
from tachometry.spec.core.sensors import SENSORS, changes

EVERY = [(name, decoding) for name, sensor in SENSORS.items() for decoding in sensor.decodings]


def walk(lines: int) -> list[tuple[int, ...]]:
    """Return levels in an order in which each comes before each, and each pair between any two."""
    every = list(itertools.product((0, 1), repeat=lines))
    rng = np.random.default_rng(lines)
    order = [levels for pair in itertools.product(every, repeat=2) for levels in pair]
    return order + [every[place] for place in rng.integers(0, len(every), 200)]


@pytest.mark.parametrize(("name", "decoding"), EVERY)
def test_the_table_is_that_of_the_data_sheet(name: str, decoding: int) -> None:
    table = changes(name, decoding)
    legal = possible(name, len(SENSORS[name].lines))
    assert {*SENSORS[name].legal} == {*legal}
    assert table.keys() == {*itertools.product(legal, repeat=2)}
    for (before, after), found in table.items():
        decoder = Decoder(name, decoding)
        assert decoder.see(before) == (0, False)
        assert found == decoder.see(after), (before, after)


@pytest.mark.parametrize("reverse", [False, True])
@pytest.mark.parametrize(("name", "decoding"), EVERY)
def test_every_change_in_every_order(name: str, decoding: int, reverse: bool) -> None:
    encoder = Encoder(8, decoding, name, reverse)
    lines = encoder.kind.lines
    levels = walk(len(lines))
    rows = [{f"level_{line}": level for line, level in zip(lines, each, strict=True)} for each in levels]
    rows = [{"ready": 0, **rows[0]}, {"ready": 1, **rows[0]}, *rows[1:]]
    seen = clock_by_clock(decoder_of(encoder), [*rows, {}], ["step", "decode_error"])
    program = Decoder(name, decoding, reverse=reverse)
    expected = [program.see(each) for each in levels]
    assert [(row["step"], bool(row["decode_error"])) for row in seen[1 : len(levels) + 1]] == expected
    assert {step for step, _ in expected} == ({0, -1 if reverse else 1} if name == "pulses" else {-1, 0, 1})
    assert any(wrong for _, wrong in expected) == (name != "pulses")


@pytest.mark.parametrize(("name", "decoding"), [pair for pair in EVERY if pair[0] != "quadrature"])
def test_the_golden_model_sees_every_change(name: str, decoding: int) -> None:
    encoder = Encoder(8, decoding, name)
    levels = [each for each, _ in itertools.groupby(walk(len(encoder.kind.lines)))]
    columns = [np.array(line, dtype=np.uint8) for line in zip(*levels, strict=True)]
    step, wrong = looked_up(encoder, columns, brief=False)
    program = Decoder(name, decoding)
    assert list(zip(step.tolist(), wrong.tolist(), strict=True)) == [program.see(each) for each in levels]


def test_halls_that_are_all_equal_are_told_once_and_forgotten() -> None:
    """A connector that is not plugged in, then turns again: the count goes on from the state before."""
    encoder = Encoder(8, sensor="hall")
    levels = [(1, 1, 1), (1, 1, 1), (1, 0, 1), (0, 0, 0), (1, 1, 1), (1, 0, 0), (1, 1, 0)]
    rows = [dict(zip(("level_a", "level_b", "level_c"), each, strict=True)) for each in levels]
    seen = clock_by_clock(
        decoder_of(encoder), [{"ready": 0, **rows[0]}, {"ready": 1}, *rows, {}], ["step", "decode_error"]
    )
    assert [(row["step"], row["decode_error"]) for row in seen[1:]] == [
        *((0, 1), (0, 0), (0, 0), (0, 0), (0, 1), (0, 0), (1, 0), (1, 0), (0, 0))
    ]


def test_an_encoder_has_the_counts_of_its_sensor() -> None:
    assert Encoder(4, sensor="hall").counts_per_rev == 24
    assert replace(Encoder(4), sensor="quadrature").decoding == 4


@pytest.mark.parametrize("decoding", [1, 2, 4])
def test_neither_step_nor_error_until_ready(decoding: int) -> None:
    for first, second in itertools.product(CYCLE, repeat=2):
        rows = [
            {"ready": 0, "level_a": first[0], "level_b": first[1]},
            {"level_a": second[0], "level_b": second[1]},
            {"ready": 1},
        ]
        seen = clock_by_clock(QuadratureDecoder(decoding), rows, ["step", "decode_error"])
        assert all(row == {"step": 0, "decode_error": 0} for row in seen)


def test_bad_decoding() -> None:
    with pytest.raises(ValueError, match=r"^decoding must be 1, 2 or 4, not 3$"):
        QuadratureDecoder(3)
