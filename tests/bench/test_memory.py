"""The benchmark of memory plays what its rows name."""

from pathlib import Path

import pytest
from support.script import load

from tachometry.sim.captures.read import read_capture

bench = load("memory")


@pytest.mark.parametrize("suffix", [".vcd", ".csv", ".sr"])
def test_files_have_as_many_changes(suffix: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "measured", list)
    words = bench.over_size(tmp_path, suffix, 10)
    assert words[:2] == [f"replay {suffix}", "1e+01"]
    capture = read_capture(words[words.index("replay") + 1])
    assert len(capture.time) - 1 == 10
    assert capture.n_together == 0
    assert capture.duration == pytest.approx(500e-6, abs=26e-6)
