"""A board is watched by one page at a time."""

import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from support.demo import BOARD, CLOCK_HZ, TEXTS, ToldBoard, demo_map, manifest_of

from tachometry.boards.simulated.board import SimulatedBoard
from tachometry.cli.commands import Refused
from tachometry.cli.explore import live as module
from tachometry.cli.explore.live import Live

OPTIONS = {**TEXTS, "method": "m"}


@pytest.fixture
def told() -> ToldBoard:
    board = ToldBoard(demo_map())
    board.shown = {"VELOCITY": 1 << 10, "POSITION": 77}
    return board


@pytest.fixture
def attached(told: ToldBoard, tmp_path: Path) -> Iterator[tuple[Live, str]]:
    """Return what answers, and the port of a board that is attached."""
    manifest = tmp_path / "demo.json"
    manifest.write_text(json.dumps(manifest_of(demo_map())), encoding="utf-8")
    with SimulatedBoard(told, CLOCK_HZ) as board:
        live = Live(board.path, manifest)
        yield live, board.path
        live.close()
        live.join()


def until(live: Live, session: str, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """Return the first message that fits."""
    while not wanted(found := live.frames(session, "-1")):
        pass
    return found


def test_a_board_is_watched_and_set(attached: tuple[Live, str], told: ToldBoard) -> None:
    live, port = attached
    assert next(iter(live.boards()["boards"])) == port
    started = live.start({}, port)
    session = started["session"]
    found = until(live, session, lambda found: len(found["rows"]) > 5)
    time, velocity, lower, upper = found["rows"][-1]
    assert time > 0
    assert velocity == pytest.approx(1024 * demo_map().spec.velocity.rad_per_s_per_lsb)
    assert (lower, upper) == (None, None)
    assert dict(found["facts"][0])["position"] == "77 counts"
    assert dict(found["facts"][1])["overflows"] == "0"
    assert live.frames(session, str(math.inf))["rows"] == []
    assert told.word("SPEED") == 0  # nothing is set by itself
    ranges = {one["name"]: (one["least"], one["most"], one["unit"]) for one in started["settings"]}
    for name, (least, most, unit) in ranges.items():
        for value in (least, most):
            assert live.set(session, {name: f"{value}{unit}"}) == {}
    while told.word("SPEED") == 0:
        live.frames(session, "-1")
    for name, text in {"speed": "1e9rad/s", "jitter": "90%", "nothing": "1"}.items():
        with pytest.raises(Refused, match=f"--set .*{name}"):
            live.set(session, {name: text})
    live.stop(session)
    assert until(live, session, lambda found: found["over"])["told"] == "stopped"


def test_the_last_page_has_the_board(attached: tuple[Live, str]) -> None:
    live, port = attached
    first = live.start({}, port)["session"]
    until(live, first, lambda found: bool(found["rows"]))
    second = live.start({}, port)["session"]
    for ask in (lambda: live.frames(first, "-1"), lambda: live.set(first, {}), lambda: live.stop(first)):
        with pytest.raises(Refused, match="another page"):
            ask()
    until(live, second, lambda found: bool(found["rows"]))


def test_a_refused_start_leaves_the_board_of_the_page_before(
    attached: tuple[Live, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    live, port = attached
    first = live.start({}, port)["session"]

    def refused(*_: object) -> None:
        raise ValueError("refused")

    with monkeypatch.context() as patch:
        patch.setattr(module, "emulator_settings", refused)
        with pytest.raises(Refused, match="refused"):
            live.start({}, port)
    rows = len(until(live, first, lambda found: bool(found["rows"]))["rows"])
    assert not until(live, first, lambda found: found["over"] or len(found["rows"]) > rows)["over"]


def test_a_slow_core_is_watched() -> None:
    """Its full scale is below the least acceleration of the emulated encoder."""
    live = Live(None, None)
    slow = {"method": "m", "ppr": "1", "tick": "1ms", "max-time": "1s", "max-speed": "0.01rad/s"}
    assert 0 < live.start(slow, f"sim:{BOARD}")["settings"][0]["value"] < 0.1
    assert live._watched is not None
    assert live._watched._session._timeout == 30  # seconds: the computer that simulates may be busy
    live.close()
    live.join()


def test_a_page_that_is_gone_leaves_the_board(attached: tuple[Live, str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_PATIENCE", 0.0)
    live, port = attached
    session = live.start({}, port)["session"]
    assert until(live, session, lambda found: found["over"])["told"].startswith("stopped")


def test_a_board_that_is_none(attached: tuple[Live, str], told: ToldBoard) -> None:
    told.noise = b"no tachometer" * 9
    live, port = attached
    found = until(live, live.start({}, port)["session"], lambda found: found["over"])
    assert "sends bytes that no tachometer sends" in found["told"]


@pytest.mark.parametrize(
    ("options", "port", "said"),
    [
        (OPTIONS, "/dev/tty", "must be that of the command line or a simulated one"),
        (OPTIONS, "sim:none", "must be a serial port or one of sim:"),
        ({**OPTIONS, "ppr": "x"}, f"sim:{BOARD}", "--ppr must be a whole number"),
        ({**OPTIONS, "clock": "100MHz", "tick": "50clk"}, "", "must be that of the command line"),
    ],
)
def test_what_cannot_be_watched(options: dict[str, str], port: str, said: str) -> None:
    with pytest.raises(Refused, match=said):
        Live(None, None).start(options, port)
