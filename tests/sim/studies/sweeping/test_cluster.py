"""Nobody but a sweep itself can talk to its processes."""

import asyncio
import os
import socket
import ssl

import psutil
import pytest
from distributed import Security
from distributed.comm import connect

from tachometry.sim.studies.sweeping import cluster


def listening() -> list[tuple[str, int]]:
    """Return addresses at which this process and those that it has started accept connections."""
    here = psutil.Process(os.getpid())
    processes = [here, *here.children(recursive=True)]
    found = [connection for process in processes for connection in process.net_connections("inet")]
    return [(one.laddr.ip, one.laddr.port) for one in found if one.status == psutil.CONN_LISTEN]


def answer(address: tuple[str, int], *, tls: bool) -> bytes:
    """Return what a stranger is told who asks for a page."""
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    with socket.create_connection(address) as plain:
        plain.settimeout(60)
        try:
            with context.wrap_socket(plain) if tls else plain as stream:
                stream.sendall(b"GET /info/main/workers.html HTTP/1.0\r\n\r\n")
                return stream.recv(1000)
        except (ssl.SSLError, OSError):
            return b""


def test_the_processes_of_a_sweep_answer_no_stranger() -> None:
    before = set(listening())
    with cluster.cluster(None, 1) as client:
        assert client.submit(sum, [1, 2]).result() == 3
        opened = [address for address in listening() if address not in before]
        assert {ip for ip, _ in opened} == {"127.0.0.1"}
        for address in opened:
            if page := answer(address, tls=False):  # an HTTP server without a page
                assert page.startswith(b"HTTP/1.1 404")
            else:  # TLS, which wants a certificate
                assert answer(address, tls=True) == b""
        addresses = [client.scheduler.address, *client.scheduler_info()["workers"]]
        assert {address.split(":")[0] for address in addresses} == {"tls"}
        for address in addresses:
            for security in (Security(), Security.temporary()):
                place = address if security.tls_ca_file else address.replace("tls:", "tcp:")
                arguments = security.get_connection_args("client")
                with pytest.raises((OSError, TypeError)):
                    asyncio.run(connect(place, timeout=1, **arguments))
