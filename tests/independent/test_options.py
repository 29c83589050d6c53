"""That the cores have every option of every method, every unit, and the ends of every range; and import nothing."""

import ast
import sys
from pathlib import Path

import pytest
from independent.cases import CASES, LONG
from independent.manifest import WORDS
from reference.settings import PER_TURN, Settings

ALL = [case.settings for case in (*CASES, *LONG)]
ENDS: dict[str, set[object]] = {
    "tick": {1, 2, 1 << 20},
    "max_ticks": {2, 1 << 20},
    "filter": {0, 255},
    "frac_bits": {4, 24},
    "velocity_bits": {None, 64},
    "position_bits": {8, 48},
    "average": {1, 256},
    "decoding": {1, 2, 4},
    "position_fine_bits": {1, 16},
}


def of(method: str) -> list[Settings]:
    """Return the cores of a method."""
    return [settings for settings in ALL if settings.method == method]


# `check_manifest` holds this list against the manifest of every core, so that a new option needs a case here.
@pytest.mark.parametrize(("method", "word"), [(method, word) for method in WORDS for word in WORDS[method].values()])
def test_every_option_of_every_method_has_a_case(method: str, word: str) -> None:
    without = (method, word) in (("rairan", "external-tick"), ("track", "bounds"), ("track", "edge-error"))
    words = {"frac-bits": {"frac-bits", "lsb"}, "tick": {"tick", "dt"}}.get(word, {word})
    assert without or any(words & settings.words.keys() for settings in of(method))


@pytest.mark.parametrize("method", WORDS)
def test_every_unit_and_decoding_of_every_method_has_a_case(method: str) -> None:
    assert {settings.unit for settings in of(method)} == {"count/tick", *PER_TURN}
    assert {settings.decoding for settings in of(method)} == {1, 2, 4}


def test_every_estimate_and_flag_has_a_case() -> None:
    assert {settings.estimate for settings in of("rairan")} == {"n1", "n2", "n3"}
    for method in ("t", "mt", "rairan"):
        assert {settings.flag("bound-decay", True) for settings in of(method)} == {True, False}
        assert {settings.paper_exact for settings in of(method)} == {True, False}
    assert {settings.lattice for settings in of("mt")} == {settings.lattice for settings in of("t")} == {True, False}
    assert any(not settings.flag("cancel", True) for settings in of("s"))
    multipliers = {settings.words.get("multiplier", "auto") for settings in of("track")}
    assert multipliers == {"auto", "serial", "block"}


@pytest.mark.parametrize("name", ENDS)
def test_the_ends_of_every_range_have_a_case(name: str) -> None:
    assert ENDS[name] <= {getattr(settings, name) for settings in ALL}


@pytest.mark.parametrize("path", sorted(Path(__file__).parent.glob("*.py")), ids=lambda path: path.name)
def test_nothing_here_imports_what_it_tests(path: Path) -> None:
    """Nor what else helps with that; tests/test_architecture.py says the same of tests/reference."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    names = [alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names]
    names += [node.module or "." for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
    assert {name.split(".")[0] for name in names} <= {*sys.stdlib_module_names, "pytest", "independent", "reference"}
