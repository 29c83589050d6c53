"""Every signal has a name that does not depend on the version of Python.

Amaranth reads the name of a signal from the bytecode after its constructor. That is an assignment to a single variable
or attribute in every version; after anything else (a tuple, a comprehension, an argument) compilers differ.
"""

import ast
from pathlib import Path

import pytest

import tachometry.hdl

NAMED = ("Signal", "Signal.like", ".read_port", ".write_port")
FILES = [path for folder in tachometry.hdl.__path__ for path in sorted(Path(folder).rglob("*.py"))]


def unnamed(source: str) -> list[int]:
    """Return lines of the signals and ports of memories whose names would be guessed."""
    tree = ast.parse(source)
    assigned = {
        id(node.value)
        for node in ast.walk(tree)
        if (isinstance(node, ast.Assign) and len(node.targets) == 1 and not isinstance(node.targets[0], ast.Tuple))
        or isinstance(node, ast.AnnAssign)
    }
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).endswith(NAMED)
        and id(node) not in assigned
        and not any(keyword.arg == "name" for keyword in node.keywords)
    ]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_no_name_is_guessed(path: Path) -> None:
    assert unnamed(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "line",
    ["a, b = Signal(), Signal()", "a = [Signal.like(b)]", "a = b = Signal()", "f(Signal())", "a, b = m.read_port(), c"],
)
def test_guesses_are_found(line: str) -> None:
    assert set(unnamed(line)) == {1}


@pytest.mark.parametrize(
    "line", ["a = Signal()", "self.a = Signal.like(b)", "a: int = Signal(3)", "f(Signal(name='a'))"]
)
def test_plain_assignments_are_none(line: str) -> None:
    assert unnamed(line) == []
