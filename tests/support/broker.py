"""A broker of MQTT 3.1.1 for tests: quality of service 0, retained messages, and the will of clients that are gone."""

import socket
import threading
from contextlib import AbstractContextManager, suppress

CONNECT, PUBLISH, SUBSCRIBE, PING, DISCONNECT = 1, 3, 8, 12, 14


def _string(data: bytes, at: int) -> tuple[bytes, int]:
    end = at + 2 + int.from_bytes(data[at : at + 2])
    return data[at + 2 : end], end


class Broker(AbstractContextManager["Broker"]):
    """Listens at a port of this machine; a context manager, which drops all clients when it ends."""

    def __init__(self, port: int = 0) -> None:
        self._listening = socket.create_server(("127.0.0.1", port))
        self.port: int = self._listening.getsockname()[1]
        self._clients: dict[socket.socket, bytes | None] = {}  # the topic that each has subscribed to, with all below
        self._retained: dict[bytes, bytes] = {}
        self._threads = [threading.Thread(target=self._accept)]
        self._threads[0].start()

    def __exit__(self, *_: object) -> None:
        self._listening.shutdown(socket.SHUT_RDWR)
        for client in [*self._clients]:
            self.drop(client)
        for thread in self._threads:
            thread.join()
        self._listening.close()

    def drop(self, client: socket.socket | None = None) -> None:
        """Cut the connection of a client, or of the first one."""
        with suppress(OSError):
            (client or next(iter(self._clients))).shutdown(socket.SHUT_RDWR)

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self._listening.accept()
                self._clients[client] = None
                self._threads.append(threading.Thread(target=self._serve, args=(client,)))
                self._threads[-1].start()

    def _serve(self, client: socket.socket) -> None:
        will = None
        with client, client.makefile("rb") as stream, suppress(OSError):
            while head := stream.read(1):
                size = shift = 0
                while (byte := stream.read(1)[0]) & 128:
                    size, shift = size | (byte & 127) << shift, shift + 7
                body, kind = stream.read(size | byte << shift), head[0] >> 4
                if kind == CONNECT:
                    _, at = _string(body, 10)
                    if body[7] & 4:
                        topic, at = _string(body, at)
                        will = (topic, _string(body, at)[0])
                    client.sendall(b"\x20\x02\x00\x00")
                elif kind == SUBSCRIBE:
                    topic = _string(body, 2)[0].removesuffix(b"/#")
                    self._clients[client] = topic
                    client.sendall(b"\x90\x03" + body[:2] + b"\x00")
                    for one, text in self._retained.items():
                        self._send(client, one, text)
                elif kind == PUBLISH:
                    topic, at = _string(body, 0)
                    self._publish(topic, body[at:], retained=bool(head[0] & 1))
                elif kind == PING:
                    client.sendall(b"\xd0\x00")
                elif kind == DISCONNECT:
                    will = None
        del self._clients[client]
        if will is not None:
            self._publish(*will, retained=True)

    def _publish(self, topic: bytes, text: bytes, *, retained: bool) -> None:
        if retained:
            self._retained[topic] = text
        for client in [*self._clients]:
            self._send(client, topic, text)

    def _send(self, client: socket.socket, topic: bytes, text: bytes) -> None:
        wanted = self._clients.get(client)
        if wanted is None or not topic.startswith(wanted):
            return
        body = len(topic).to_bytes(2) + topic + text
        size = bytes([len(body)]) if len(body) < 128 else bytes([len(body) & 127 | 128, len(body) >> 7])
        with suppress(OSError):
            client.sendall(b"\x30" + size + body)
