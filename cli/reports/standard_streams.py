"""Standard streams, what may be written to them, and the exit statuses; it imports little, as it is needed at once."""

import io
import os
import sys
from typing import TextIO

INTERNAL = 70  # exit status: a fault of the program, as sysexits.h has it
INTERRUPTED = 130  # 128 + SIGINT, as shells have it
UNREAD = 141  # 128 + SIGPIPE, likewise

_STREAMS = ("stdin", "stdout", "stderr")


def prepare_streams() -> None:
    """Open standard streams that were closed, on nothing, and write UTF-8 whatever the locale is.

    Without it the first file that is opened would become the standard output.
    """
    for descriptor, name in enumerate(_STREAMS):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # the lowest number that is free, which is this one
        if getattr(sys, name) is None:
            setattr(sys, name, open(descriptor, "r" if name == "stdin" else "w", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8", errors="backslashreplace")


def silence(stream: TextIO) -> None:
    """Send what is still written to a stream nowhere: its reader is gone."""
    try:
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, stream.fileno())
        os.close(nothing)
    except (OSError, ValueError):  # not a file
        pass


def printable(text: str) -> str:
    """Return a text without the characters that a terminal would obey: it may come from a file. Line ends stay."""
    return text if text.isprintable() else "".join(c for c in text if c.isprintable() or c == "\n")
