"""Telemetry is published where other programs read it: at an MQTT broker, or as EPICS process variables.

A value is only published when a frame has it. While the board is silent, readers are notified in place of a value.
"""

import asyncio
import json
import re
import threading
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, Self
from urllib.parse import SplitResult, urlsplit

from tachometry.boards.monitor.columns import Column
from tachometry.boards.monitor.session import Frame
from tachometry.spec.language.tools import imported

_FORMS = "--publish must be mqtt://HOST/TOPIC, mqtt://USER:PASSWORD@HOST:PORT/TOPIC or epics:PREFIX"
_NEEDS = "--publish needs {}: pip install 'tachometry[publish]'"
_SECONDS = 5.0  # in which a server must begin, or end


def publisher_of(address: str, columns: Sequence[Column]) -> "Mqtt | Epics":
    """Return the publisher of an address; ValueError if it is none, OSError if its package is not installed."""
    if re.fullmatch(r"epics:[\w:.<>\[\]-]{1,40}", address, re.ASCII):
        return Epics(address.removeprefix("epics:"), columns)
    if not re.fullmatch(r"mqtt://([^/@#+]+@)?[\w.-]+(:\d{1,5})?/[^#+]+", address):
        raise ValueError(f"{_FORMS}, not {address!r}")
    return Mqtt(urlsplit(address), columns)


class Mqtt:
    """Publishes a JSON object for each frame at TOPIC; TOPIC/units and TOPIC/status are retained.

    The status is `online`, `waiting: WHY`, or `offline`, which the broker publishes by itself for a monitor that is
    gone. Without a broker, frames are dropped, and it is connected to again.
    """

    def __init__(self, address: SplitResult, columns: Sequence[Column]) -> None:
        version = imported("paho.mqtt.enums", _NEEDS.format("paho-mqtt")).CallbackAPIVersion.VERSION2
        self._place, self._topic = (address.hostname or "", address.port or 1883), address.path.strip("/")
        self._columns, self._status = columns, "waiting: no frame yet"
        self._client = imported("paho.mqtt.client", _NEEDS.format("paho-mqtt")).Client(version)
        if address.username:
            self._client.username_pw_set(address.username, address.password)
        self._client.will_set(f"{self._topic}/status", "offline", retain=True)
        self._client.reconnect_delay_set(1, 10)
        self._client.on_connect = lambda *_: self._introduce()

    def __enter__(self) -> Self:
        self._client.connect_async(*self._place)
        self._client.loop_start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._client.is_connected():
            self._client.publish(f"{self._topic}/status", "offline", retain=True).wait_for_publish(_SECONDS)
        self._client.disconnect()
        self._client.loop_stop()

    def write(self, frame: Frame) -> None:
        """Publish the values of a frame; what is absent is null."""
        if self._client.is_connected():
            values = {column.name: column.value(frame.snapshot) for column in self._columns}
            self._client.publish(self._topic, json.dumps({"time": frame.time, **values}))

    def waits(self, why: str) -> None:
        """Publish the status, if it has changed."""
        before, self._status = self._status, f"waiting: {why}" if why else "online"
        if self._status != before:
            self._client.publish(f"{self._topic}/status", self._status, retain=True)

    def _introduce(self) -> None:
        units = {"time": "s"} | {column.name: column.unit for column in self._columns if column.unit}
        self._client.publish(f"{self._topic}/units", json.dumps(units), retain=True)
        self._client.publish(f"{self._topic}/status", self._status, retain=True)


class Epics:
    """Serves a process variable PREFIX + NAME for each value, by Channel Access.

    Its alarm is UDF, INVALID, before the first frame and where a frame has no such value, and COMM, INVALID, while the
    board is silent; it keeps the last value then.
    """

    def __init__(self, prefix: str, columns: Sequence[Column]) -> None:
        caproto = imported("caproto", _NEEDS.format("caproto"))
        self._prefix, self._columns, self._why = prefix, columns, ""
        severity, status = caproto.AlarmSeverity, caproto.AlarmStatus
        self._fine, self._undefined, self._silent = (
            {"status": one, "severity": severity.INVALID_ALARM if one else severity.NO_ALARM}
            for one in (status.NO_ALARM, status.UDF, status.COMM)
        )
        # A position may have more bits than a whole number of EPICS.
        kinds: Mapping[type, Any] = {bool: caproto.ChannelInteger, float: partial(caproto.ChannelDouble, precision=6)}
        self._variables: dict[str, Any] = {
            one.name: kinds.get(one.kind, caproto.ChannelDouble)(
                value=0, units=one.unit, alarm=caproto.ChannelAlarm(**self._undefined)
            )
            for one in columns
        }
        for variable in self._variables.values():
            variable.check_access = lambda *_: caproto.AccessRights.READ  # nobody else writes
        self._runner, self._thread = asyncio.Runner(), threading.Thread(target=self._serve, daemon=True)
        self._begun, self._ended = threading.Event(), asyncio.Event()

    def _serve(self) -> None:
        with self._runner:
            self._runner.run(self._run())

    async def _run(self) -> None:
        """Serve until `_ended`."""
        from caproto.asyncio.server import Context

        async def begun(_: object) -> None:
            self._begun.set()

        server = Context({f"{self._prefix}{name}": variable for name, variable in self._variables.items()})
        serving = asyncio.ensure_future(server.run(startup_hook=begun))
        await self._ended.wait()
        serving.cancel()
        await asyncio.wait([serving])

    def __enter__(self) -> Self:
        self._loop = self._runner.get_loop()
        self._thread.start()
        if not self._begun.wait(_SECONDS):
            raise OSError(f"--publish epics:{self._prefix} cannot be served: the ports of Channel Access are in use")
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.call_soon_threadsafe(self._ended.set)
        self._thread.join(_SECONDS)

    def write(self, frame: Frame) -> None:
        """Write all variables."""
        values = {column.name: column.value(frame.snapshot) for column in self._columns}
        asyncio.run_coroutine_threadsafe(self._write(values, self._undefined), self._loop)

    def waits(self, why: str) -> None:
        """Set the alarms, if the board has become silent."""
        if why and why != self._why:
            asyncio.run_coroutine_threadsafe(self._write(dict.fromkeys(self._variables), self._silent), self._loop)
        self._why = why

    async def _write(self, values: Mapping[str, Any], absent: Mapping[str, Any]) -> None:
        """Write values; where there is none, the alarm `absent`."""
        for name, value in values.items():
            if value is None:
                await self._variables[name].write_metadata(**absent)
            else:
                await self._variables[name].write(value, **self._fine)
