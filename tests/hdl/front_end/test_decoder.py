import itertools

import pytest
from reference.front import CYCLE
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.decoder import QuadratureDecoder


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
