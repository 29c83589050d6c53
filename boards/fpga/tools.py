"""Finds the programs of the extra `boards`, runs them, and asks for their versions."""

import importlib.metadata
import os
import shutil
import sysconfig
from collections.abc import Iterable, Sequence
from pathlib import Path

from tachometry.sim.signals.temporary import run_tool
from tachometry.spec.language.tools import complaint

EXTRA = "pip install 'tachometry[boards]'"


class ToolError(OSError):
    """A program is missing or has failed; the message is one line."""


def scripts() -> str:
    """Return the folder of the programs that packages have brought to this Python."""
    return sysconfig.get_path("scripts")


def find(name: str) -> str:
    """Return the path of a program: beside this Python, or on the PATH; ToolError if there is none."""
    folders = os.pathsep.join((scripts(), os.environ.get("PATH", os.defpath)))
    found = shutil.which(name, path=folders)
    if found is None:
        raise ToolError(f"{name} is needed for boards and not installed: {EXTRA}")
    return found


def run(command: Sequence[str], folder: Path) -> None:
    """Run a program in a folder; it sees nothing above it (YoWASP).

    It raises ToolError if it is missing or fails, with the first line that tells of an error, or the last one.
    """
    done = run_tool([find(command[0]), *command[1:]], folder)
    if done.returncode:
        raise ToolError(f"{command[0]}: {complaint(done.stdout + done.stderr) or f'exit status {done.returncode}'}")


def versions(packages: Iterable[str]) -> dict[str, str]:
    """Return versions of packages; ToolError if one is not installed."""
    try:
        return {package: importlib.metadata.version(package) for package in packages}
    except importlib.metadata.PackageNotFoundError as error:
        raise ToolError(f"{error.name} is needed for boards and not installed: {EXTRA}") from error
