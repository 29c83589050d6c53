"""The command `tachometry`, in this process."""

import threading

import pytest

from tachometry.cli.main import main
from tachometry.cli.reports import terminal

terminal.LINE_SECONDS = threading.TIMEOUT_MAX  # what a command says must not depend on how long it takes


def run(*args: object) -> int:
    """Return its exit status."""
    with pytest.raises(SystemExit) as stop:
        main([str(arg) for arg in args])
    assert isinstance(stop.value.code, int)
    return stop.value.code
