import itertools

import pytest
from reference.front import CYCLE, count_of
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.decoder import QuadratureDecoder


def expected(decoding: int, before: tuple[int, int], after: tuple[int, int]) -> tuple[int, int]:
    return count_of(decoding, before, after), int(before[0] != after[0] and before[1] != after[1])


@pytest.mark.parametrize("decoding", [1, 2, 4])
def test_every_transition(decoding: int) -> None:
    for before, after in itertools.product(CYCLE, repeat=2):
        rows = [{"ready": 0, "level_a": before[0], "level_b": before[1]}, {"ready": 1}]
        rows += [{"level_a": after[0], "level_b": after[1]}, {}]
        seen = clock_by_clock(QuadratureDecoder(decoding), rows, ["step", "decode_error"])
        got = [(row["step"], row["decode_error"]) for row in seen]
        assert got[1] == got[3] == (0, 0)
        assert got[2] == expected(decoding, before, after), (before, after)


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


@pytest.mark.parametrize("line", ["level_a", "level_b"])
@pytest.mark.parametrize("other", [0, 1])
@pytest.mark.parametrize("decoding", [1, 2, 4])
def test_a_line_that_dithers_never_creeps(decoding: int, other: int, line: str) -> None:
    still = "level_b" if line == "level_a" else "level_a"
    rows = [{"ready": 1, still: other}] + [{line: k % 2} for k in range(101)]
    seen = clock_by_clock(QuadratureDecoder(decoding), rows, ["step"])
    position = 0
    for row in seen[2:]:
        position += row["step"]
        assert abs(position) <= 1


def test_bad_decoding() -> None:
    with pytest.raises(ValueError, match=r"^decoding must be 1, 2 or 4, not 3$"):
        QuadratureDecoder(3)
