"""Which layer may import which, and what the project promises of its folders."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
STDLIB_ONLY = {"spec"}
ALLOWED = {
    "spec": {"spec"},
    "hdl": {"hdl", "spec"},
    "sim": {"sim", "hdl", "spec"},
    "sim/golden": {"spec", "sim.golden", "sim.signals"},
    "cli": {"cli", "sim", "hdl", "spec"},
}


def imports(file: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            assert node.level == 0, f"relative import in {file}"
            found.add(node.module)
            found |= {f"{node.module}.{alias.name}" for alias in node.names if node.module == "tachometry"}
    return found


def files(folder: str) -> list[Path]:
    recursive = [file for file in (ROOT / folder).rglob("*.py") if folder != "sim" or "golden" not in file.parts]
    assert recursive
    return recursive


@pytest.mark.parametrize("folder", ALLOWED)
def test_import_directions(folder: str) -> None:
    for file in files(folder):
        ours = {name.removeprefix("tachometry.") for name in imports(file) if name.startswith("tachometry.")}
        outside = {
            name for name in ours if not any(name == other or name.startswith(f"{other}.") for other in ALLOWED[folder])
        }
        assert not outside, f"{file.relative_to(ROOT)} imports {outside}"


def test_spec_needs_only_the_standard_library() -> None:
    import sys

    for file in files("spec"):
        top = {name.split(".")[0] for name in imports(file)}
        assert top <= set(sys.stdlib_module_names) | {"tachometry"}, file


def test_golden_models_need_only_numpy() -> None:
    for file in files("sim/golden"):
        top = {name.split(".")[0] for name in imports(file)}
        assert top <= {"tachometry", "numpy", "typing", "collections", "dataclasses", "importlib", "bisect"}, file


@pytest.mark.parametrize("folder", ALLOWED)
def test_files_can_be_read_on_a_few_screens(folder: str) -> None:
    for file in files(folder):
        assert len(file.read_text().splitlines()) <= 400, file
