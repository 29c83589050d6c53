"""The notebook runs from its first cell to its last, and shows little text."""

import ast
import json
from pathlib import Path
from typing import Any

import pytest

NOTEBOOK = Path(__file__).parents[2] / "examples" / "drive.ipynb"


def test_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    codes = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    names: dict[str, Any] = {}
    shown = list[Any]()
    monkeypatch.chdir(tmp_path)
    for code in codes:
        *statements, last = ast.parse(code).body
        assert isinstance(last, ast.Expr)
        exec(compile(ast.Module(statements, []), "drive.ipynb", "exec"), names)
        shown.append(eval(compile(ast.Expression(last.value), "drive.ipynb", "eval"), names))
    assert all(len(repr(value)) < 1000 for value in shown)
    assert names["run"].n_mismatches == 0
    assert shown[0] == "track"
    assert shown[-1][:2] == ["spindle.v", "spindle.json"]
    assert (tmp_path / "build" / "drive" / "spindle.v").is_file()
