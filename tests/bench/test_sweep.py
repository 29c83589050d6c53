"""The benchmark of sweeps measures what it says."""

from itertools import islice

import pytest
from support.script import load

bench = load("sweep")


def test_a_row_for_every_way(monkeypatch: pytest.MonkeyPatch) -> None:
    points = bench.all_points()
    assert len(points) == 400
    monkeypatch.setattr(bench, "all_points", lambda: dict(islice(points.items(), 3)))
    rows = bench.table([])
    assert [row[:2] for row in rows] == [["this process", "3"]]
    assert float(rows[0][3]) > 0
    assert len(rows[0]) == len(bench.COLUMNS)
