"""Programs: where they are found, and what is told of those that fail."""

import importlib.metadata
from pathlib import Path

import pytest
from support.fake_tools import FakeTools

from tachometry.boards.fpga import tools


def test_programs_of_this_python_come_before_those_on_the_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    FakeTools(tmp_path / "path", monkeypatch, "here there")
    FakeTools(tmp_path / "scripts", monkeypatch, "here")
    monkeypatch.setenv("PATH", str(tmp_path / "path"))
    assert tools.find("here") == str(tmp_path / "scripts" / "here")
    assert tools.find("there") == str(tmp_path / "path" / "there")
    with pytest.raises(tools.ToolError, match=r"^nowhere is needed for boards and not installed: pip install 'tach"):
        tools.find("nowhere")


@pytest.mark.parametrize(
    ("output", "line"),
    [
        ("", ""),
        ("\n one\n\n last \n\n", "last"),
        ("Info: no\nERROR: it is too big\nERROR: and too slow\n2 errors\n", "ERROR: it is too big"),
        ("x" * 1000, "x" * 300),
    ],
)
def test_one_line_is_told(output: str, line: str) -> None:
    assert tools.told(output) == line


def test_versions_are_those_that_are_installed() -> None:
    assert tools.versions(["amaranth"]) == {"amaranth": importlib.metadata.version("amaranth")}
    with pytest.raises(tools.ToolError, match=r"^nonsense-of-nobody is needed for boards and not installed: pip "):
        tools.versions(["amaranth", "nonsense-of-nobody"])
