"""Every extra is tested alike: gates agree with the golden model, registers have its ports, and a rule of its own.

A test of an extra lists cores, and a rule that reads what they show without the product's help.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import pytest

from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.run import Run
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import of_options, of_texts
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import RegisterMap

BASE = {"ppr": "25", "clock": "1MHz", "tick": "20clk", "max-time": "60clk"}


@dataclass(frozen=True)
class Case:
    """A core, in words such as `zero-speed=3rad/s age=yes`, on a hostile motion."""

    method: str
    words: str
    edges: int = 30

    @property
    def texts(self) -> dict[str, str]:
        return BASE | dict(word.split("=") for word in self.words.split())

    @property
    def unit(self) -> str:
        """The unit in which the words have the speed."""
        return next(unit for unit in ("rad/s", "rpm") if unit in self.words)

    def run(self) -> Run:
        """Run it, and compare every bit with the golden model."""
        spec = of_texts(self.method, self.texts)
        found = lockstep(spec, stress(spec, seed=1, n_edges=self.edges).until(20_000), PySim())
        assert found.n_mismatches == 0, found.first
        return found.actual

    def rows(self) -> Iterator[Any]:
        """Yield what the core shows in each clock with a tick or an update, speeds also in rad/s."""
        spec, run = of_texts(self.method, self.texts), self.run()
        lsb = manifest(spec)["velocity"]["rad_per_s_per_lsb"]
        by_clock: dict[int, dict[str, Any]] = {}
        for strobe in ("tick", "velocity_valid"):
            table = run.tables[strobe]
            for k, clock in enumerate(table.clock.tolist()):
                row = by_clock.setdefault(clock, {"clock": clock, "tick": False, "velocity_valid": False})
                row |= {strobe: True, **{name: column[k].item() for name, column in table.columns.items()}}
        for _, row in sorted(by_clock.items()):
            yield SimpleNamespace(**row, rad_per_s=row.get("velocity", 0) * lsb)


def in_lockstep(cases: Sequence[Case], rule: Callable[[Case], None]) -> Callable[[Case], None]:
    """Return the test of an extra."""

    @pytest.mark.parametrize("case", cases, ids=lambda case: f"{case.method} {case.words}")
    def test(case: Case) -> None:
        spec = of_texts(case.method, case.texts)
        assert of_options(spec.options) == spec  # the manifest makes it again
        ports = {port.name for extra in spec.extras for port in extra.ports(spec)}
        mapped = {field.port for register in RegisterMap(spec, irq=True) for field in register.fields}
        assert ports
        assert ports <= mapped | {port.name for port in spec.ports.pins}
        rule(case)

    return test
