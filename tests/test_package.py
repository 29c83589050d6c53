"""The package itself: its version, and `python -m tachometry`."""

import importlib.metadata
import inspect
import subprocess
import sys
from dataclasses import fields

import pytest

import tachometry
from tachometry.spec import METHODS


def test_version() -> None:
    assert tachometry.__version__ == importlib.metadata.version("tachometry")
    with pytest.raises(AttributeError, match="no attribute 'versoin'"):
        tachometry.versoin  # noqa: B018


def test_it_can_be_run() -> None:
    done = subprocess.run([sys.executable, "-m", "tachometry", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"tachometry {tachometry.__version__}\n")


@pytest.mark.parametrize("method", METHODS)
def test_docstrings_have_inherited_parameters(method: str) -> None:
    text = inspect.getdoc(METHODS[method])
    assert text is not None
    assert text.count("\nParameters\n----------\n") == 1
    for field in fields(METHODS[method]):
        assert text.count(f"\n{field.name} : ") == 1, field.name
    assert text.index(": Encoder\n") < (text + "\n\nRaises\n------\n").index("\n\nRaises\n------\n")
