"""The entry of the command `tachometry`: it imports little, so that Ctrl-C is heard from the beginning."""

import os
import signal
import sys
import threading
from collections.abc import Sequence
from types import FrameType
from typing import NoReturn

from tachometry.cli.reports.standard_streams import INTERNAL, INTERRUPTED, UNREAD, prepare_streams, printable, silence
from tachometry.sim.signals.temporary import STOPS

_LONGEST = 2000  # characters of a message, which may quote what is in a file


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; errors are reported in one line on stderr, never by a traceback."""
    prepare_streams()
    interrupts = _Interrupts()
    try:
        try:
            code = _run(sys.argv[1:] if args is None else args, interrupts)
            sys.stdout.flush()
        finally:
            interrupts.over = args is None  # else the process goes on, and hears signals
    except KeyboardInterrupt as interrupt:
        code = _interrupted(str(interrupt))
    except BrokenPipeError:
        silence(sys.stdout)
        code = UNREAD
    except OSError as error:
        code = _fail(f"error: cannot write standard output: {error.strerror or error}")
        silence(sys.stdout)
    except Exception as error:
        # What is interrupted while it is imported may raise anything.
        code = _interrupted() if interrupts.heard else _fail(_report(error), INTERNAL)
    sys.exit(code)


class _Interrupts:
    """Let signals that stop a command end the process while commands are imported, then raise KeyboardInterrupt."""

    def __init__(self) -> None:
        self.heard = self.over = False
        self._ready = False
        if threading.current_thread() is threading.main_thread():
            for number in STOPS:
                if signal.getsignal(number) is not signal.SIG_IGN:
                    signal.signal(number, self._hear)

    def ready(self) -> None:
        """From now on there is something to be tidied up."""
        self._ready = True

    def _hear(self, number: int, frame: FrameType | None) -> None:
        if self.over:  # what is left to do is to say how it has ended
            return
        self.heard = True
        if not self._ready:
            os._exit(_interrupted())
        raise KeyboardInterrupt


def _run(args: Sequence[str], interrupts: _Interrupts) -> int:
    from tachometry.cli.commands import Refused, run

    interrupts.ready()
    try:
        return run(args)
    except Refused as error:
        return _fail(f"error: {error}")


def _interrupted(how_far: str = "") -> int:
    import warnings

    # The simulator's, if they had not begun yet.
    warnings.filterwarnings("ignore", message="coroutine .* was never awaited")
    return _fail(f"interrupted {how_far}".rstrip(), INTERRUPTED)


def _report(error: Exception) -> str:
    place = error.__traceback__
    while place is not None and place.tb_next is not None:
        place = place.tb_next
    where = f" ({os.path.basename(place.tb_frame.f_code.co_filename)}, line {place.tb_lineno})" if place else ""
    return (
        f"internal error: {type(error).__name__}: {error}{where}; this is a fault of tachometry: please report it, "
        "with the command line and the files"
    )


def _fail(message: str, code: int = 2) -> int:
    line = printable(" ".join(message.split()))
    if len(line) > _LONGEST:
        line = f"{line[: _LONGEST // 2]} … {line[-_LONGEST // 2 :]}"
    try:
        print(f"tachometry: {line}", file=sys.stderr, flush=True)
    except OSError:  # nobody reads it
        silence(sys.stderr)
    return code
