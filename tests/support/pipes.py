"""Pipes between the processes of a test."""

import os
import select

_PATIENCE = 600.0  # seconds, which only a process that hangs takes


def read(descriptor: int) -> bytes:
    """Return a byte of a pipe of `os.pipe`, or none when nobody has its other end any more."""
    assert select.select([descriptor], [], [], _PATIENCE)[0], "nobody has written to the pipe, or closed it"
    return os.read(descriptor, 1)
