"""A board is watched for the page: one at a time, and for as long as the page looks."""

import secrets
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

from tachometry.boards.fpga.boards import BOARDS
from tachometry.boards.monitor.columns import columns
from tachometry.boards.monitor.emulator_settings import Fields, emulator_settings, limits
from tachometry.boards.monitor.serial_port import SerialPort
from tachometry.boards.monitor.session import Session
from tachometry.boards.monitor.watch import State, watch
from tachometry.cli.commands import Refused, refusals
from tachometry.cli.explore.answers import Answer, Texts, check, of_one_axis
from tachometry.cli.options.core import CoreTexts
from tachometry.cli.options.target import SIMULATED, Target, target_of
from tachometry.cli.reports.monitor import measured_rows, received_rows, wrong_rows
from tachometry.sim.studies.plan import default_range
from tachometry.spec import AUTO
from tachometry.spec.registers.emulator import rate_of

_EVERY = 0.01  # seconds from a frame of telemetry to the next
_PATIENCE = 15.0  # seconds after which nobody looks any more
_ORDERLY = 10.0  # seconds in which a board must be given back
_KEPT = 1024  # frames
_ROOM = 1.25  # of the speed that a core is for, so that it is seen what it does beyond


class Live:
    """Answers what the page asks of boards, by its `functions`: of one at a port, or of simulated ones.

    It raises ValueError if `manifest` is not that of a board at a port.
    """

    def __init__(self, port: str | None, manifest: Path | None) -> None:
        if port is None and manifest is not None:
            raise ValueError("--manifest must be given together with the PORT of a board")
        if port is not None and port.startswith(SIMULATED):
            raise ValueError(f"PORT must be a serial port, not {port!r}: a simulated board is chosen in the page")
        self._attached = None if port is None else target_of(port, CoreTexts("auto", {}, False), manifest)
        self._watched: _Watched | None = None
        self._changing = threading.Lock()
        self.functions: Mapping[str, Callable[..., Answer]] = {
            "boards": self.boards,
            "start": self.start,
            "frames": self.frames,
            "set": self.set,
            "stop": self.stop,
        }

    def boards(self) -> Answer:
        """Return the ports of boards that can be watched, and what people call them."""
        attached = {} if self._attached is None else {self._attached.port: self._attached.title}
        return {"boards": attached | {SIMULATED + name: f"{one.title}, simulated" for name, one in BOARDS.items()}}

    def start(self, options: Texts, port: str) -> Answer:
        """Watch a board from now on, in place of the one before; a simulated one has the core of these options."""
        target, settings = self._target(options, port), dict[str, float]()
        spec, top = target.registers.spec, limits(target.registers.spec)
        most = min(_ROOM * default_range(spec)[1], top["speed"][1])
        if target.is_simulated:
            settings["speed"] = float(f"{most / 4:.3g}")
        with self._changing, refusals():
            fields = emulator_settings(spec, [f"{name}={n}" for name, n in settings.items()])
            fields |= {"rate": max(rate_of(spec, most), 1)} if target.is_simulated else {}
            watched = _Watched(target, fields)  # what is refused leaves the board before
            if self._watched is not None and not self._watched.ended():
                raise Refused("the board before is still being given back: try again")
            self._watched = watched
            watched.thread.start()
        ranges = top | {"speed": (-most, most, "rad/s")}
        return {
            "session": self._watched.name,
            "title": target.title,
            "unit": spec.scale.shown_unit.name,
            "settings": [
                {"name": name, "least": low, "most": high, "unit": unit, "value": settings.get(name, 0.0)}
                for name, (low, high, unit) in ranges.items()
            ],
        }

    def frames(self, session: str, since: str) -> Answer:
        """Return the frames after a time of the board, in seconds, and the state of the session."""
        with refusals():
            return self._of(session).news(float(since))

    def set(self, session: str, settings: Texts) -> Answer:
        """Change settings of the emulated encoder, as `monitor --set` does."""
        watched = self._of(session)
        with refusals():
            words = [f"{name}={text}" for name, text in settings.items()]
            watched.settings.append(emulator_settings(watched.target.registers.spec, words))
        return {}

    def stop(self, session: str) -> Answer:
        """Give the board back."""
        self._of(session).stop.set()
        return {}

    def close(self) -> None:
        """Give back what is watched, and do not wait for it."""
        if self._watched is not None:
            self._watched.stop.set()

    def join(self) -> None:
        """Wait until it is given back."""
        if self._watched is not None:
            self._watched.ended()

    def _of(self, session: str) -> "_Watched":
        if self._watched is None or self._watched.name != session:
            raise Refused("another page watches a board now: start it here again")
        return self._watched

    def _target(self, options: Texts, port: str) -> Target:
        if self._attached is not None and port == self._attached.port:
            return self._attached
        if not port.startswith(SIMULATED):
            raise Refused(f"the board must be that of the command line or a simulated one, not {port!r}")
        check(options)  # what is wrong is said as there
        texts = {name: text for name, text in of_one_axis(options).items() if text and name != "clock"}
        with refusals():
            return target_of(port, CoreTexts(options.get("method") or AUTO, texts, True), None)


class _Watched(AbstractContextManager["_Watched"]):
    """A board that a thread watches; it is the display of the thread, too."""

    def __init__(self, target: Target, settings: Fields) -> None:
        self.target, self.name, self.stop = target, secrets.token_hex(8), threading.Event()
        self.settings: deque[Fields] = deque()
        spec = target.registers.spec
        tick = float(spec.timing.tick_seconds)
        self._state = State(target.title, spec, {column.name: column for column in columns(target.registers)})
        about = (target.port, self._open, target.manifest, max(round(_EVERY / tick), 1), settings)
        self._session = Session(*about, self.notice, target.timeout)
        self._port = target.port
        self._rows: deque[tuple[Any, ...]] = deque(maxlen=_KEPT)
        self._told = "compiling the board…" if target.is_simulated else "connecting…"
        self._facts: list[list[tuple[str, str]]] = []
        self._looked, self._over, self._busy = time.monotonic(), False, threading.Lock()
        self.thread = threading.Thread(target=self._run, name=f"watching {target.port}", daemon=True)

    def ended(self) -> bool:
        """Give the board back; whether it is."""
        self.stop.set()
        self.thread.join(_ORDERLY)
        return not self.thread.is_alive()

    def news(self, since: float) -> Answer:
        """Return rows after a time in seconds: time, velocity, its lower and upper bound."""
        with self._busy:
            self._looked = time.monotonic()
            rows = [row for row in self._rows if row[0] > since]
            return {"rows": rows, "facts": self._facts, "told": self._told, "over": self._over}

    def _run(self) -> None:
        told = "stopped"
        try:
            with refusals(), self.target.presence() as self._port:
                watch(self._session, self._state, self, (), None, self.stop)
        except Refused as error:
            told = str(error)
        except Exception as error:
            told = f"internal error: {type(error).__name__}: {error}; this is a fault of tachometry: please report it"
        with self._busy:
            self._told, self._over = told, True

    def _open(self) -> SerialPort:
        return self.target.open(self._port)

    def __exit__(self, *_: object) -> None:
        pass

    def notice(self, text: str) -> None:
        with self._busy:
            self._told = text

    def show(self, state: State) -> None:
        """Take what is new, and set what is to be set, in the thread that has the port."""
        with suppress(IndexError):
            while True:
                self._session.set(self.settings.popleft())
        with self._busy:
            last = self._rows[-1][0] if self._rows else -1.0
            self._rows.extend(row for row in state.history if row[0] > last)
            self._facts = [measured_rows(state), wrong_rows(state), received_rows(state)]
            if time.monotonic() - self._looked > _PATIENCE:
                self.stop.set()

    def end(self, state: State) -> None:
        """Show the state for the last time."""
