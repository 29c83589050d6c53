"""Runs that need more memory than is free are refused before they begin."""

import math
from pathlib import Path

import pytest

from tachometry.cli.main import main
from tachometry.sim.signals import memory

CORE = ["--method", "m", "--ppr", "1", "--clock", "1MHz", "--tick", "20us", "--age"]


@pytest.fixture
def free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the folder of files in which the system tells what is free: 100 MiB, and no limit of the group."""
    (tmp_path / "meminfo").write_text("MemTotal: 999999 kB\nMemAvailable: 102400 kB\n")
    (tmp_path / "memory.max").write_text("max\n")
    (tmp_path / "memory.current").write_text("1000\n")
    monkeypatch.setattr(memory, "_MEMINFO", tmp_path / "meminfo")
    monkeypatch.setattr(memory, "_CGROUP", tmp_path)
    return tmp_path


def test_the_least_of_all_limits_is_free(free: Path) -> None:
    assert memory.free_bytes() == 100 << 20
    (free / "memory.max").write_text("51000\n")
    assert memory.free_bytes() == 50_000
    for name in ("memory.max", "meminfo"):
        (free / name).unlink()
    assert memory.free_bytes() == math.inf


@pytest.mark.parametrize(
    ("motion", "refused"),
    [
        ("constant:1rad/s:6s", "what is run needs some 0.19 GiB of memory, and 0.098 GiB are free: shorten it, or "),
        ("constant:1e7rad/s:200ms", "--motion needs some 0.13 GiB of memory, and 0.098 GiB are free: shorten it, or "),
    ],
)
@pytest.mark.usefixtures("free")
def test_a_run_that_would_not_fit_is_refused_in_a_line(
    motion: str, refused: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match=r"^2$"):
        main(["simulate", *CORE, "--motion", motion])
    (line,) = capsys.readouterr().err.splitlines()
    assert refused in line
