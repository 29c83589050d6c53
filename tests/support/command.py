"""The command `tachometry`, in this process."""

import pytest

from tachometry.cli.main import main


def run(*args: object) -> int:
    """Return its exit status."""
    with pytest.raises(SystemExit) as stop:
        main([str(arg) for arg in args])
    assert isinstance(stop.value.code, int)
    return stop.value.code
