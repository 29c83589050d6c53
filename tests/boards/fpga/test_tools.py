"""Programs are found beside this Python, then on the path."""

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


def test_versions_are_those_that_are_installed() -> None:
    assert tools.versions(["amaranth"]) == {"amaranth": importlib.metadata.version("amaranth")}
    with pytest.raises(tools.ToolError, match=r"^nonsense-of-nobody is needed for boards and not installed: pip "):
        tools.versions(["amaranth", "nonsense-of-nobody"])
