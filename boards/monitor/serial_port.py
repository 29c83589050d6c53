"""Serial ports have one kind of error for all that can happen to them."""

import errno
import os
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from tachometry.spec.language.tools import imported

_WAIT = 0.02  # seconds for the first byte
# What the system says of a port that is not there, for now.
_ABSENT = frozenset((errno.ENOENT, errno.ENODEV, errno.ENXIO, errno.EIO))
_BUSY = frozenset((errno.EAGAIN, errno.EBUSY))


class Unplugged(OSError):
    """The port of this name is not there, for now."""

    def __init__(self, name: str, why: str) -> None:
        super().__init__(f"{name}: {why}")
        self.why = why


def pyserial() -> Any:
    """Return the module that opens serial ports; OSError if it is not installed."""
    return imported("serial", "serial ports need pyserial: pip install 'tachometry[host]'")


class SerialPort(AbstractContextManager["SerialPort"]):
    """Opens a serial port, such as `/dev/ttyUSB1` or `COM5`, that nobody else uses; it is a context manager.

    It raises Unplugged if there is no such port, as `read` and `write` do if it is no more, and OSError if it cannot be
    used, or pyserial is not installed.
    """

    def __init__(self, name: str, baud: int) -> None:
        self.name, serial = name, pyserial()
        try:
            with _told(name, opens=True):
                self._port: Any = serial.Serial(name, baud, timeout=_WAIT, write_timeout=1.0, exclusive=True)
        except ValueError as error:
            raise OSError(f"{name} must be a serial port that can be used at {baud} bits a second: {error}") from error

    def __exit__(self, *_: object) -> None:
        self.close()

    def read(self, size: int = 1, /) -> bytes:
        """Return the bytes received; if there are none, the first ones within a short time."""
        with _told(self.name):
            return bytes(self._port.read(max(1, min(size, self._port.in_waiting))))

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""
        with _told(self.name):
            written = self._port.write(data)
            return None if written is None else int(written)

    def close(self) -> None:
        """Give the port back."""
        self._port.close()


@contextmanager
def _told(name: str, *, opens: bool = False) -> Iterator[None]:
    """Raise what pyserial and the system say of a port in one way."""
    import serial

    try:
        yield
    except serial.SerialTimeoutException as error:
        raise Unplugged(name, "it takes no bytes") from error
    except (ValueError, AttributeError, TypeError):
        raise
    except Exception as error:
        number = _number(error)
        why = str(error) if number is None else os.strerror(number)
        if number in _ABSENT or "FileNotFoundError" in why or (number is None and not opens):
            raise Unplugged(name, why) from error
        raise OSError(f"{name} is used by another program" if number in _BUSY else f"{name}: {why}") from error


def _number(error: BaseException) -> int | None:
    """Return the number that the system has for an error, which pyserial may have wrapped."""
    wrapped: BaseException | None = error
    while wrapped is not None:
        # Beside OSError, termios has an error of its own.
        for number in (getattr(wrapped, "errno", None), *wrapped.args[:1]):
            if isinstance(number, int):
                return number
        wrapped = wrapped.__context__
    return None
