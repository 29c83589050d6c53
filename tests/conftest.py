"""All tests share these fixtures and hooks."""

import gc
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest

# Compiled cores stay in the checkout.
os.environ.setdefault("TACHOMETRY_CACHE", str(Path(__file__).parent.parent / "build" / "cache"))

# A shell ignores Ctrl-C for what it runs in the background, and commands that tests begin would ignore it, too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

gc.disable()  # while tests are collected, which all stay


def pytest_collection_finish() -> None:
    """Let Python look for garbage among what tests make, and no more in what was collected."""
    gc.freeze()
    gc.enable()


@pytest.fixture
def generated(tmp_path: Path) -> Callable[..., Path]:
    """Return the command `tachometry generate` in this process: the folder in which it has written a core's files."""

    def generate(name: str, *words: str) -> Path:
        from support.command import run

        assert run("generate", "--name", name, "-o", tmp_path, *words) == 0
        return tmp_path

    return generate
