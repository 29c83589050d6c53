"""The tools that this project calls fail with many lines, of which one says why, and packages may be missing."""

import re
from importlib import import_module
from typing import Any

_LONGEST = 300  # characters
_NO_MEMORY = "Cannot allocate memory"


def imported(module: str, why: str) -> Any:
    """Return a module of a package that need not be installed; OSError with this line if it is not."""
    try:
        return import_module(module)
    except ImportError as error:
        raise OSError(why) from error


def complaint(said: str) -> str:
    """Return the line that says why a tool has failed, of all that it has said; empty if it has said nothing."""
    lines = [line.strip() for line in said.splitlines() if line.strip()] or [""]
    of_error = [line for line in lines if "error" in line.lower()]
    traced = any(line.startswith("Traceback ") for line in lines)  # which quotes its sources, too
    line = (lines[-1:] if traced else of_error or lines[-1:])[0][:_LONGEST]
    line = re.sub(r"^[\w.]+(Error|Exception|Expired): ", "", line)  # the class of a Python error
    return f"{line}; it needs some 5 GB of addresses, see ulimit -v" if _NO_MEMORY in line else line
