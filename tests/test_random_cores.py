"""Random cores are right in every bit, or refused in a line: as exported Verilog, against the golden model."""

from dataclasses import replace
from pathlib import Path

import pytest
from support.nightly import nightly
from support.random_cores import motions, random_options
from support.verilog import run_in_icarus

from tachometry.cli.reports.axes import axes_rows
from tachometry.cli.reports.core import core_rows
from tachometry.hdl.export import export
from tachometry.sim import golden
from tachometry.sim.signals.run import compare
from tachometry.spec import AxesSpec, CoreSpec, ParameterError, of_options

# Cores that are played in a second: every method and sensor, and number 205, a constant of which was too wide.
SEEDS = (3, 6, 12, 13, 20, 26, 28, 31, 42, 59, 61, 205)
MANY, PARTS = 2000, 8


def made(texts: dict[str, str]) -> CoreSpec | None:
    """Return the core of these options, which those that it names make again; None if it is refused, in a line."""
    try:
        spec = of_options(texts)
    except ParameterError as error:
        check_message(error)
        return None
    assert isinstance(spec, CoreSpec)
    assert of_options(spec.options) == spec
    assert axes_rows(spec) if isinstance(spec, AxesSpec) else core_rows(spec, None)
    return spec


def check_message(error: ParameterError) -> None:
    assert len(str(error).splitlines()) == 1
    assert len(str(error)) < 400


def check(seed: int, folder: Path) -> bool:
    """Play the core of a seed, if it is not refused; whether it was played."""
    texts, bus = random_options(seed)
    shown = f"seed {seed}: {' '.join(f'--{name} {text}' for name, text in texts.items())}"
    try:
        spec = made(texts)
        if spec is None:
            return False
        if bus != "none":
            export_with_registers(spec, bus)
        for trace in motions(spec, seed):
            expected = golden.run(spec, trace)
            if any(len(table) for table in expected.tables.values()):  # a tick may be longer than the motion
                count, first = compare(expected, run_in_icarus(spec, folder, trace))
                assert count == 0, first
    except Exception as error:
        error.add_note(shown)
        raise
    return True


def export_with_registers(spec: CoreSpec, bus: str) -> None:
    """Export the core with registers on a bus, which may reach too few of them or be too slow."""
    try:
        export(replace(spec, parallel=True) if isinstance(spec, AxesSpec) else spec, bus=bus)
    except ParameterError as error:
        check_message(error)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_core(seed: int, tmp_path: Path) -> None:
    assert check(seed, tmp_path)


@nightly
@pytest.mark.parametrize("part", range(PARTS))
def test_many_random_cores(part: int, tmp_path: Path) -> None:
    played = [check(seed, tmp_path) for seed in range(part, MANY, PARTS)]
    assert 0.5 < sum(played) / len(played) < 0.95
