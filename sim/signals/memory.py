"""Work that would need more memory than is free is refused before it begins."""

import math
from contextlib import suppress
from pathlib import Path

from tachometry.spec.control import AnySpec

EDGE = 110  # bytes of an edge on its way to a report, as `bench/memory.py` measures
_CELL = 29  # bytes of a value in a row of a strobe
_MEMINFO, _CGROUP = Path("/proc/meminfo"), Path("/sys/fs/cgroup")


def free_bytes() -> float:
    """Return the bytes that this process may still take, as far as the system tells."""
    limits = [math.inf]
    with suppress(OSError, ValueError, StopIteration):
        lines = _MEMINFO.read_text(encoding="ascii").splitlines()
        limits.append(1024.0 * int(next(line for line in lines if line.startswith("MemAvailable")).split()[1]))
    with suppress(OSError, ValueError):  # "max" is no limit
        most, used = (int((_CGROUP / f"memory.{name}").read_text(encoding="ascii")) for name in ("max", "current"))
        limits.append(most - used)
    return max(min(limits), 0)


def bytes_of(spec: AnySpec, n_ticks: float, n_edges: int) -> float:
    """Return about how many bytes a run takes that is held as a whole: a row for each tick, and one for an update."""
    return n_edges * EDGE + 2 * n_ticks * _CELL * (1 + len(spec.ports.outputs))


def check_memory(needed: float, what: str, remedy: str) -> None:
    """Check that so many bytes are free; ValueError with `what` needs them, and what to do, if they are not."""
    if needed > (free := free_bytes()):
        raise ValueError(
            f"{what} needs some {needed / 2**30:.2g} GiB of memory, and {free / 2**30:.2g} GiB are free: {remedy}"
        )
