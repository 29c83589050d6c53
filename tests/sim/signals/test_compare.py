"""The comparison of runs finds every difference: any cell of any row, and any row that only one run has."""

from fractions import Fraction

import numpy as np
import pytest

from tachometry.sim.signals.run import Comparison, Mismatch, Run, Table, compare
from tachometry.spec import METHODS, Encoder, TachometerSpec, Timing
from tachometry.spec.core.index import Index

TIMING = Timing(1_000_000, 1000, 64)
N_ROWS = 4


def spec_of(method: str) -> TachometerSpec:
    """Return a core with as many outputs as the method can have."""
    bounds = METHODS[method].facts.bounds
    options: dict[str, object] = {"bounds": bounds, "age": True, "index": Index(), "filter_clocks": 2, "unit": "rpm"}
    own: dict[str, object] = (
        {"adaptive": Fraction(1, 10)} if method == "rairan" else {"external_tick": True, "max_tick_cycles": 2000}
    )
    return METHODS[method](encoder=Encoder(500), timing=TIMING, **options, **own)  # type: ignore[arg-type]


def run_of(spec: TachometerSpec) -> Run:
    """Return a run with some rows in every table, and another number in every cell."""
    numbers = iter(range(10**6))
    tables = {}
    for strobe, names in spec.ports.strobes.items():
        columns = {name: np.array([next(numbers) for _ in range(N_ROWS)]) for name in names}
        tables[strobe] = Table(np.arange(N_ROWS) * 7 + 3, columns)
    return Run(1000, tables)


def cells(spec: TachometerSpec) -> list[tuple[str, str]]:
    """Return every column of every table."""
    return [(strobe, name) for strobe, names in spec.ports.strobes.items() for name in ("clock", *names)]


def with_cell(run: Run, strobe: str, name: str, row: int, change: int) -> Run:
    """Return the run with another number in one cell."""
    table = run.tables[strobe]
    column = table[name].copy()
    column[row] ^= change
    return Run(run.n_clocks, run.tables | {strobe: table.having(**{name: column})})


@pytest.mark.parametrize("method", METHODS)
def test_every_output_of_the_manifest_is_compared(method: str) -> None:
    spec = spec_of(method)
    compared = {name for strobe, names in spec.ports.strobes.items() for name in (strobe, *names)}
    assert compared == {port.name for port in spec.ports.outputs}
    bounds = {"velocity_lower", "velocity_upper", "bounds_valid"} if METHODS[method].facts.bounds else set[str]()
    assert {*bounds, "interval", "standstill", "age"} <= compared


@pytest.mark.parametrize("change", [1, 1 << 40, 1 << 62])
@pytest.mark.parametrize("method", METHODS)
def test_any_cell(method: str, change: int) -> None:
    spec = spec_of(method)
    run = run_of(spec)
    for strobe, name in cells(spec):
        for row in range(N_ROWS):
            wrong = with_cell(run, strobe, name, row, change)
            for pair in ((run, wrong), (wrong, run)):
                was, got = (int(side.tables[strobe][name][row]) for side in pair)
                clock = min(int(side.tables[strobe].clock[row]) for side in pair)
                assert compare(*pair) == (1, [Mismatch(f"{strobe}.{name}", row, was, got, clock)])


@pytest.mark.parametrize("method", METHODS)
def test_rows_that_only_one_run_has(method: str) -> None:
    spec = spec_of(method)
    run = run_of(spec)
    for strobe, names in spec.ports.strobes.items():
        for kept in (slice(0, N_ROWS - 1), slice(0, 1), slice(0, 0)):
            fewer = Run(run.n_clocks, run.tables | {strobe: run.tables[strobe].rows(kept)})
            missing = N_ROWS - kept.stop
            for pair in ((run, fewer), (fewer, run)):
                count, first = compare(*pair)
                assert count == missing * (1 + len(names))
                assert [found.signal for found in first] == [f"{strobe}.{name}" for name in ("clock", *names)]
                assert all(found.row == kept.stop for found in first)
                assert all((found.expected is None) == (pair[0] is fewer) for found in first)


def test_pieces_are_compared_as_the_whole() -> None:
    """Golden rows come one by one, and a row ahead; two cells are wrong, the last rows of one strobe are not there."""
    spec = spec_of("mt")
    run = run_of(spec)
    for strobe, name in cells(spec):
        for row in range(N_ROWS):
            wrong = with_cell(with_cell(run, strobe, name, row, 1), strobe, name, N_ROWS - 1, 1)
            wrong.tables["decode_error"] = run.tables["decode_error"].rows(slice(row))
            comparison = Comparison()
            for nth in range(N_ROWS + 1):
                sides = (
                    (comparison.expect, run, slice(nth, nth + 1)),
                    (comparison.add, wrong, slice(max(nth - 1, 0), nth)),
                )
                for take, of, rows in sides:
                    take(Run(0, {each: table.rows(rows) for each, table in of.tables.items()}))
            comparison.end(run.n_clocks)
            count, first = compare(run, wrong)
            assert (comparison.n_mismatches, {*comparison.first}) == (count, {*first})
