"""Clients that others wrote read published telemetry, also when the broker comes back; no value is invented."""

import json
import queue
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from caproto import CaprotoError
from caproto.sync.client import read, sockets, write
from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion
from support.broker import Broker
from support.command import run
from support.demo import BOARD, WORDS

from tachometry.boards.monitor.columns import Column
from tachometry.boards.monitor.publisher import publisher_of
from tachometry.boards.monitor.session import Frame

VALUES = {
    "velocity": ("rpm", float),
    "position": ("counts", int),
    "forced": ("", bool),
    "velocity_lower": ("rpm", float),
}
COLUMNS = [Column(name, *about, lambda now, name=name: now.get(name)) for name, about in VALUES.items()]  # type: ignore[misc]
SECONDS = 20.0  # in which a message must come


def frame(time: float, **values: Any) -> Frame:
    return Frame(time, values)  # type: ignore[arg-type]


@contextmanager
def heard(port: int, topic: str) -> Iterator["queue.Queue[tuple[str, str]]"]:
    """Yield the messages that come at a topic and below."""
    messages: queue.Queue[tuple[str, str]] = queue.Queue()
    client = Client(CallbackAPIVersion.VERSION2)
    client.reconnect_delay_set(1, 1)

    def subscribe(*_: Any) -> None:
        client.subscribe(f"{topic}/#")

    client.on_connect = subscribe
    client.on_message = lambda _, __, message: messages.put((message.topic, message.payload.decode()))
    client.connect("127.0.0.1", port)
    client.loop_start()
    yield messages
    client.disconnect()
    client.loop_stop()


def until(messages: "queue.Queue[tuple[str, str]]", wanted: tuple[str, str]) -> list[tuple[str, str]]:
    """Return the messages before one that must come."""
    before = []
    while (message := messages.get(timeout=SECONDS)) != wanted:
        before.append(message)
    return before


def test_a_broker_has_each_frame_and_the_state_of_the_board() -> None:
    with Broker() as broker:
        port = broker.port
        publisher = publisher_of(f"mqtt://127.0.0.1:{port}/shop/axis1", COLUMNS)
        with heard(port, "shop/axis1") as messages:
            with publisher:
                until(messages, ("shop/axis1/status", "waiting: no frame yet"))
                publisher.waits("")
                until(messages, ("shop/axis1/status", "online"))
                publisher.write(frame(0.5, velocity=12.5, position=1 << 40, forced=True))
                topic, text = messages.get(timeout=SECONDS)
                assert topic == "shop/axis1"
                values = {"velocity": 12.5, "position": 1 << 40, "forced": True, "velocity_lower": None}
                assert json.loads(text) == {"time": 0.5, **values}
                publisher.waits("it is silent")
                assert messages.get(timeout=SECONDS) == ("shop/axis1/status", "waiting: it is silent")
            assert until(messages, ("shop/axis1/status", "offline")) == []


def test_a_broker_that_comes_back_is_connected_to_again() -> None:
    """Frames of the time without a broker are not published later."""
    with Broker() as broker:
        port = broker.port
        publisher = publisher_of(f"mqtt://127.0.0.1:{port}/axis1", COLUMNS)
        publisher.__enter__()
        with heard(port, "axis1") as messages:
            publisher.waits("")
            until(messages, ("axis1/status", "online"))
    lost = frame(1.0, velocity=1.0)
    for _ in range(3):
        publisher.write(lost)
    with Broker(port) as broker, heard(port, "axis1") as messages:
        before = until(messages, ("axis1/status", "online"))
        publisher.write(frame(2.0, velocity=2.0))
        before += until(
            messages, ("axis1", json.dumps({"time": 2.0, "velocity": 2.0} | dict.fromkeys(list(VALUES)[1:])))
        )
        assert {topic for topic, _ in before} <= {"axis1/status", "axis1/units"}
        units = {"time": "s", "velocity": "rpm", "position": "counts", "velocity_lower": "rpm"}
        assert ("axis1/units", json.dumps(units)) in before
        publisher.__exit__()
        until(messages, ("axis1/status", "offline"))


def test_variables_have_values_units_and_alarms(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    for name in ("EPICS_CA_ADDR_LIST", "EPICS_CAS_INTF_ADDR_LIST"):
        monkeypatch.setenv(name, "127.0.0.1")
    monkeypatch.setenv("EPICS_CA_AUTO_ADDR_LIST", "NO")
    monkeypatch.setenv("EPICS_CA_SERVER_PORT", str(port))

    def shown(name: str) -> tuple[Any, ...]:
        found = read(f"axis1:{name}", data_type="control", timeout=SECONDS, repeater=False)
        return found.data[0], found.metadata.units.decode(), int(found.metadata.status), int(found.metadata.severity)

    def becomes(name: str, wanted: tuple[Any, ...]) -> None:
        for _ in range(100):
            if shown(name) == wanted:
                return
        assert shown(name) == wanted

    undefined, silent = (17, 3), (9, 3)  # UDF and COMM, INVALID
    publisher = publisher_of("epics:axis1:", COLUMNS)
    with publisher:
        assert shown("velocity") == (0, "rpm", *undefined)
        publisher.write(frame(0.5, velocity=12.5, position=1 << 40, forced=True))
        becomes("forced", (1, "", 0, 0))
        with pytest.raises(CaprotoError):
            write("axis1:velocity", 99.0, timeout=1, notify=True, repeater=False)
        assert shown("velocity") == (12.5, "rpm", 0, 0)
        assert shown("position") == (1 << 40, "counts", 0, 0)
        assert shown("velocity_lower") == (0, "rpm", *undefined)
        publisher.waits("it is silent")
        becomes("forced", (1, "", *silent))
        assert shown("velocity") == (12.5, "rpm", *silent)
        publisher.write(frame(0.6, velocity=13.5, position=3, forced=False))
        becomes("velocity", (13.5, "rpm", 0, 0))
        for circuit in sockets.values():  # of the client
            circuit.close()


def test_the_monitor_publishes_what_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    with Broker() as broker, heard(broker.port, "axis1") as messages:
        address = f"mqtt://127.0.0.1:{broker.port}/axis1"
        words = ("--set", "speed=100rad/s", "--duration", "1s", "--plain", "--publish", address)
        assert run("monitor", f"sim:{BOARD}", *WORDS, "--method", "s", *words) == 0
        every = until(messages, ("axis1/status", "offline"))
    found = [json.loads(text) for topic, text in every if topic == "axis1"]
    assert ("axis1/status", "online") in every
    assert capsys.readouterr().out
    assert len(found) > 1
    assert found[-1]["velocity"] == pytest.approx(100, rel=0.5)
    assert [one["time"] for one in found] == sorted(one["time"] for one in found)


@pytest.mark.parametrize(
    "address", ["http://host/topic", "mqtt://host", "mqtt://host:x/topic", "mqtt://host/a/#", "epics:", "x"]
)
def test_what_is_no_address(address: str) -> None:
    with pytest.raises(ValueError, match="--publish must be mqtt://HOST/TOPIC, "):
        publisher_of(address, COLUMNS)


@pytest.mark.parametrize(("package", "address"), [("paho", "mqtt://host/topic"), ("caproto", "epics:x:")])
def test_a_package_that_is_missing_is_named(package: str, address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == package] or [package]:
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(OSError, match="pip install 'tachometry\\[publish\\]'"):
        publisher_of(address, COLUMNS)
