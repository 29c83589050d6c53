"""Commands of these tests tell sizes that nothing was mapped for, except in tests that ask for `mapped`."""

import pytest

from tachometry.sim.studies import estimate
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import Bus


@pytest.fixture
def mapped() -> None:
    """Let commands estimate sizes from what is in a core, which takes a second."""


@pytest.fixture(autouse=True)
def unmapped(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Take one size for that of every core."""

    def constant(spec: AnySpec, bus: Bus | None, family: str) -> estimate.Estimate:
        return estimate.Estimate(family, 1000, 500, 200e6, spec.tachometer.timing.clock_hz)

    if "mapped" not in request.fixturenames:
        monkeypatch.setattr(estimate, "_estimate", constant)
