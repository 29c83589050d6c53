"""The package itself: its version, and `python -m tachometry`."""

import importlib.metadata
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

import tachometry

ROOT = Path(__file__).parent.parent


def test_version() -> None:
    assert tachometry.__version__ == importlib.metadata.version("tachometry")
    with pytest.raises(AttributeError, match="no attribute 'versoin'"):
        tachometry.versoin  # noqa: B018


def test_it_can_be_run() -> None:
    done = subprocess.run([sys.executable, "-m", "tachometry", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"tachometry {tachometry.__version__}\n")


def test_constraints_are_what_pyproject_allows() -> None:
    """Every package that the tests need is there once for each Python, in a version that fits, with hashes."""
    text = (ROOT / "constraints.txt").read_text()
    assert "uv pip compile --universal --generate-hashes" in text.splitlines()[1]
    pinned: dict[str, list[str]] = {}
    for entry in re.split(r"\n(?=[a-z])", text)[1:]:
        found = re.match(r"([a-z0-9-]+)==(\S+) .*\\\n    --hash=sha256:[0-9a-f]{64}", entry)
        assert found is not None, entry
        pinned.setdefault(found[1], []).append(found[2])
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"]
    needed = [Requirement(text) for text in (*project["dependencies"], *extras["test"])]
    for one in needed:
        needed += [Requirement(text) for extra in one.extras if one.name == "tachometry" for text in extras[extra]]
        for version in pinned[one.name] if one.name != "tachometry" else ():
            assert one.specifier.contains(version), (str(one), version)
