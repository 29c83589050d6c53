"""The golden registers of a core of many axes."""

from collections.abc import Sequence

import numpy as np

from tachometry.sim import golden
from tachometry.sim.golden.registers import Access, GoldenBank, rises
from tachometry.sim.signals.axes import AxesTrace
from tachometry.spec.language.port import INDEX, TICK, UPDATE
from tachometry.spec.registers.axes import AxesMap


class GoldenAxesBank(GoldenBank):
    """Answers for the bank of a core of many axes whose pins are driven so."""

    def __init__(self, registers: AxesMap, trace: AxesTrace) -> None:
        self._map = registers
        self._of_updates = set()  # what is held is 0 before the first
        self._tables = golden.run(registers.axes, trace).tables
        self._strobes = tuple(strobe for strobe in (TICK, UPDATE, INDEX) if strobe in self._tables)
        ticks, updates = self._tables[TICK], self._tables[UPDATE]
        self._updated = updates.clock
        # An update comes with the tick of its axis.
        whose = {TICK: ticks["axis"], UPDATE: ticks["axis"][np.searchsorted(ticks.clock, updates.clock)]}
        kinds = {"updated": UPDATE}
        if INDEX in self._tables:
            whose[INDEX] = self._tables[INDEX]["index_axis"]
            kinds["indexed"] = INDEX
        self._happened = {
            f"{kind}_{axis}": self._tables[strobe].clock[whose[strobe] == axis]
            for kind, strobe in kinds.items()
            for axis in range(registers.axes.axes)
        }
        overflow = np.zeros(len(ticks), dtype=bool)
        for axis in range(registers.axes.axes):
            overflow |= (ticks["axis"] == axis) & (ticks[f"overflow_{axis}"] != 0)
        self._follow(overflow)
        stalls = []
        for axis in range(registers.axes.axes):
            strobe = registers.axes.axis.facts.rests_with
            rows, own = self._tables[strobe], whose[strobe] == axis
            stalls.append(rises(rows.clock[own], rows[f"standstill_{axis}"][own]))
        self._stalls = np.unique(np.concatenate(stalls))

    def _act(self, accesses: Sequence[Access]) -> None:
        """No program writes to features beside the measurement."""

    def _of_clock(self, clock: int) -> dict[str, int]:
        return {}
