"""Where the points of a sweep run: processes of this machine, or the workers of a Dask scheduler."""

from __future__ import annotations

import asyncio
import logging
import pickle
import signal
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from multiprocessing import resource_tracker
from typing import TYPE_CHECKING, Any

from tachometry.sim.signals.temporary import scratch
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.tools import imported
from tachometry.spec.language.units import plural

if TYPE_CHECKING:
    from distributed import Client

    from tachometry.sim.studies.sweeping.loops import LoopPoint
    from tachometry.sim.studies.sweeping.sweep import Point, Row

_PATIENCE = 10.0  # seconds until a scheduler has answered
_AT_ONCE = 50  # tasks that are sent to the scheduler together: more than some MB are warned of
_MOST = 100  # points of a task: Dask takes five times as long for a task as a short point does
_TASKS = 100  # of a sweep, at least: workers end together, and little is lost with one
# Dask has its workers give all memory back at once, which takes longer than a point itself: they keep so many bytes.
_LOCAL: dict[str, Any] = {
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1 << 28,
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": 1 << 25,
    # Anybody on this machine can ask their HTTP servers, which shall have no answers.
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
}


class LostScheduler(OSError):
    """The scheduler of a sweep ended, or its machine cannot be reached."""


def require() -> None:
    """Check that the extra is there: distributed, pyarrow and cryptography."""
    for name in ("distributed", "pyarrow", "cryptography"):
        imported(name, f"a sweep needs the extra `sweep`: {name} is not installed: pip install 'tachometry[sweep]'")


@contextmanager
def cluster(scheduler: str | None, jobs: int | None) -> Iterator[Client]:
    """Yield a client of a scheduler, or, without an address, of so many processes here, by default one for each core.

    Whoever may talk to a Dask scheduler or worker may run Python there. The processes here talk to nobody else: by TLS,
    with certificates that are made for them and only live in their memory. It raises OSError if the scheduler does not
    answer.
    """
    import dask
    from distributed import Client, LocalCluster, Security

    with ExitStack() as stack:
        stack.callback(logging.disable, logging.root.manager.disable)
        logging.disable()  # what goes wrong comes as an exception
        if scheduler is not None:
            try:
                asyncio.run(_greet(scheduler))
                client = stack.enter_context(Client(scheduler, timeout=_PATIENCE))
            except (OSError, ValueError, TypeError) as error:
                raise OSError(f"--scheduler {scheduler} does not answer: {error}") from None
            if not client.scheduler_info()["workers"]:
                print(f"tachometry: {scheduler} has no workers yet: waiting for them", file=sys.stderr)
        else:
            here = {"temporary-directory": str(stack.enter_context(scratch()))}
            try:
                with _deaf_to_interrupts(), dask.config.set(_LOCAL | here):
                    local = LocalCluster(
                        n_workers=jobs,
                        threads_per_worker=1,
                        protocol="tls://",
                        security=Security.temporary(),
                        dashboard_address="127.0.0.1:0",
                        scheduler_kwargs={"dashboard": False},
                        silence_logs=logging.CRITICAL,
                    )
            except RuntimeError as error:
                raise OSError(f"cannot start the processes of a sweep: {error.__cause__ or error}") from None
            client = stack.enter_context(Client(stack.enter_context(local)))
        yield client


async def _greet(scheduler: str) -> None:
    """Check that a scheduler answers: a client has no patience's end where one accepts and says nothing."""
    from distributed import Security
    from distributed.comm import connect

    arguments = Security().get_connection_args("client")
    try:
        comm = await asyncio.wait_for(connect(scheduler, timeout=_PATIENCE, **arguments), _PATIENCE)
    except TimeoutError:
        raise OSError(f"nothing within {_PATIENCE:g} s") from None
    await comm.close()


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """Start processes that take no notice of what a terminal sends to all: this process ends them in order.

    What comes in the meantime waits until all have been started, SIGTERM too.
    """
    if threading.current_thread() is not threading.main_thread() or sys.platform == "win32":
        yield
        return
    came: list[int] = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: came.append(number))
    # Threads and processes that are started have this mask, too.
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT, signal.SIGHUP))
    resource_tracker.ensure_running()  # as it starts, it takes SIGINT out of the mask of the thread that asks
    signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGINT,))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for number in came[:1]:
            signal.raise_signal(number)


def rows(client: Client, points: Mapping[str, Point | LoopPoint], study: str = "sweeping.sweep") -> Iterator[Row]:
    """Yield rows of points, by their digests, as they come; Dask schedules them, and again where a worker was lost.

    They are run by the function `run_packed` of a module of sim.studies, `study`. At the end it raises ValueError if a
    point cannot be run, and OSError if a worker lacks what it needs; OSError at once, if one has another version, and
    LostScheduler if the scheduler goes.
    """
    from distributed import KilledWorker, as_completed

    def run(code: str, packed: bytes) -> list[Row | Exception]:
        # It travels as it is: a scheduler and workers need not know it.
        from importlib import import_module

        return [*import_module(f"tachometry.sim.studies.{study}").run_packed(code, packed)]

    digests, size = [*points], min(max(len(points) // _TASKS, 1), _MOST)
    tasks = {digests[first]: digests[first : first + size] for first in range(0, len(digests), size)}
    # Keys of one kind: what the scheduler does for a task grows with the number of kinds.
    keys = [("point", first) for first in tasks]
    futures = client.map(run, *_packed(points, tasks), key=keys, batch_size=_AT_ONCE, pure=False)
    # Nothing else may hold futures: a worker keeps the rows of one that is held, and where it dies, runs it again.
    arrived = as_completed(futures, with_results=True, raise_errors=False)
    del futures
    failed: list[Exception] = []
    for future, found in arrived:
        if future.status == "finished":
            yield from (row for row in found if not isinstance(row, Exception))
            failed += [error for error in found if isinstance(error, Exception)]
            continue
        error = found[1] if future.status == "error" else found
        if future.status == "cancelled":
            raise LostScheduler("lost the connection to the scheduler")
        if isinstance(error, ImportError):
            raise OSError(f"workers must have the same version of tachometry as this machine: {error}")
        if isinstance(error, KilledWorker):
            failed += _killed([points[digest] for digest in tasks[error.task[1]]], error)
        else:
            failed.append(error)
    if failed:
        raise _summed(failed[0], f"; {len(failed)} of {plural(len(points), 'point')} could not be run")


def _killed(group: list[Point | LoopPoint], error: Exception) -> list[Exception]:
    """Return an error for each point of a task at which workers died."""
    which = f"one of {len(group)} points, the first that" if len(group) > 1 else "the point"
    return [OSError(f"every worker died at {which} of {group[0].method} on {group[0].text}: {error}")] * len(group)


def _packed(points: Mapping[str, Point | LoopPoint], tasks: Mapping[str, list[str]]) -> tuple[list[str], list[bytes]]:
    """Return the code of each task, and its points together: what they share is sent once, and computed once."""
    codes = [points[group[0]].code for group in tasks.values()]
    return codes, [pickle.dumps([points[digest] for digest in group]) for group in tasks.values()]


def _summed(first: Exception, more: str) -> Exception:
    """Return the error of the first point that could not be run, with how many could not."""
    if isinstance(first, ValueError):
        return ParameterError.longer(first, more)
    return OSError(f"{first}{more}") if isinstance(first, OSError) else first
