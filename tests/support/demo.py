"""The compiled demo as a serial port, without a pseudo-terminal: clocks pass when somebody reads."""

from tachometry.sim.engines.board import BoardSimulation
from tachometry.spec import TachometerSpec
from tachometry.spec.registers.buses import BUSES
from tachometry.spec.registers.demo import DemoMap

UART = BUSES["uart"]


class DemoPort:
    """A board that runs some clocks in each read.

    Parameters
    ----------
    spec : TachometerSpec
    n_clocks : int
        Of a read.
    """

    def __init__(self, spec: TachometerSpec, n_clocks: int = 4000) -> None:
        self.board = BoardSimulation(DemoMap(spec), UART)
        self._n_clocks = n_clocks
        self._waiting = b""

    def write(self, data: bytes) -> None:
        self._waiting += data

    def read(self, size: int = 1) -> bytes:
        found, self._waiting = self.board.run(self._n_clocks, self._waiting)
        return found
