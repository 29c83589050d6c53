"""Every generated file says what made it, whose it is, and how it may be used."""

import functools
import importlib.metadata

LICENSE = "BSD-2-Clause"


@functools.cache
def version() -> str:
    """Return the version of tachometry."""
    return importlib.metadata.version("tachometry")


def generator() -> str:
    """Return what makes the files."""
    return f"tachometry {version()}"


def notice(mark: str) -> str:
    """Return lines of a comment that begin with `mark`."""
    lines = (
        f"Made by {generator()}.",
        "SPDX-FileCopyrightText: 2026, the Tachometry contributors",
        f"SPDX-License-Identifier: {LICENSE}",
    )
    return "".join(f"{mark} {line}\n" for line in lines)
