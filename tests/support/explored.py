"""The command `tachometry explore` as a process."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def explored(folder: Path, *args: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Give a running command, whose temporary files are in a folder, and its address."""
    process = subprocess.Popen(
        [sys.executable, "-m", "tachometry", "explore", *args],
        env={**os.environ, "TMPDIR": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.communicate()
