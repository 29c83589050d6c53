"""Files appear whole or not at all."""

from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.signals import files
from tachometry.sim.signals.files import replacing, rows_of, write_csv


def test_a_file_is_replaced_at_the_end(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("old")
    with replacing(path) as beside:
        beside.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("error", [OSError, KeyboardInterrupt])
def test_nothing_is_left_after_an_error(error: type[BaseException], tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_text("old")

    def fail() -> None:
        with replacing(path) as beside:
            beside.write_text("ne")
            raise error

    with pytest.raises(error):
        fail()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_table_of_numbers_reads_back_as_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "_ROWS", 7)
    time, count = np.random.default_rng(1).random(100) / 3, np.arange(100)
    write_csv(tmp_path / "x.csv", ("time", "count"), rows_of([time, count]))
    lines = (tmp_path / "x.csv").read_text().split("\n")
    assert lines[0] == "time,count"
    assert lines[1:] == [f"{t!r},{k}" for t, k in zip(time.tolist(), count.tolist(), strict=True)] + [""]


def test_words_are_quoted_where_they_must_be(tmp_path: Path) -> None:
    write_csv(tmp_path / "x.csv", ("ω", "b"), [('1, "2"', None), (0.1, float("nan"))])
    assert (tmp_path / "x.csv").read_bytes() == 'ω,b\n"1, ""2""",\n0.1,nan\n'.encode()
