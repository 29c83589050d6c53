"""Tables and runs, made by hand."""

import numpy as np
import pytest

from tachometry.sim.signals.run import Run, Table, compare, observed
from tachometry.spec import TachometerSpec, of_texts

TABLE = Table(np.array([3, 5, 9]), {"position": np.array([1, 2, 4]), "overflow": np.array([False, True, False])})
EMPTY = Run(10, {"tick": TABLE, "velocity_valid": TABLE, "decode_error": Table(np.array([7]), {})})


def test_columns_are_found_by_name_and_as_attributes() -> None:
    assert TABLE["position"].tolist() == TABLE.position.tolist() == [1, 2, 4]
    assert TABLE["clock"].tolist() == TABLE.clock.tolist() == [3, 5, 9]
    assert TABLE.get("overflow").tolist() == [False, True, False]
    assert TABLE.get("age").tolist() == [0, 0, 0]
    assert len(TABLE) == 3


@pytest.mark.parametrize("name", ["age", "_age", "__array__"])
def test_what_is_no_column_is_no_attribute(name: str) -> None:
    with pytest.raises(AttributeError, match=f"^the table has no column '{name}', but position, overflow$"):
        getattr(TABLE, name)
    assert not hasattr(TABLE, name)


def test_a_column_of_a_private_name_is_no_attribute() -> None:
    hidden = Table(np.array([3]), {"_kept": np.array([1])})
    assert hidden["_kept"].tolist() == [1]
    assert not hasattr(hidden, "_kept")


def test_rows_and_columns_can_be_chosen() -> None:
    assert TABLE.rows(TABLE.overflow).clock.tolist() == [5]
    assert TABLE.rows(slice(1, None)).position.tolist() == [2, 4]
    more = TABLE.having(clock=TABLE.clock + 1, position=-TABLE.position, age=np.zeros(3))
    assert (more.clock.tolist(), more.position.tolist(), [*more.columns]) == (
        [4, 6, 10],
        [-1, -2, -4],
        ["position", "overflow", "age"],
    )


def test_without_an_index_or_an_external_tick_there_are_no_rows() -> None:
    assert EMPTY.errors.tolist() == [7]
    assert len(EMPTY.index) == len(EMPTY.index.index_position) == len(EMPTY.tick_errors) == 0


def core() -> TachometerSpec:
    return of_texts(
        "s", {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "100clk", "index": "yes", "index-at": "edge"}
    )


def test_a_run_is_read_from_the_ports() -> None:
    """A row of outputs in every clock in which a strobe is high; each table takes those of its own strobe."""
    spec = core()
    names = [port.name for port in spec.ports.outputs]
    rows = np.zeros((3, 1 + len(names)), dtype=np.int64)
    rows[:, 0] = [11, 12, 20]
    for row, name, value in (
        (0, "tick", 1),
        (0, "position", -5),
        (0, "pulse_count", 3),
        (1, "velocity_valid", 1),
        (1, "velocity", 77),
        (1, "position", 9),
        (2, "tick", 1),
        (2, "position", -6),
        (2, "velocity", 8),
        (2, "standstill", 1),
    ):
        rows[row, 1 + names.index(name)] = value
    run = observed(spec, 30, rows)
    assert {strobe: table.clock.tolist() for strobe, table in run.tables.items()} == {
        "velocity_valid": [12],
        "tick": [11, 20],
        "decode_error": [],
        "index_valid": [],
    }
    assert run.ticks.position.tolist() == [-5, -6]
    assert run.ticks.standstill.tolist() == [False, True]
    assert run.ticks.standstill.dtype == np.bool_
    assert run.updates.velocity.tolist() == [77]
    assert (run.n_clocks, run.index.index_position.tolist()) == (30, [])


def test_a_missing_column_is_an_error() -> None:
    with pytest.raises(KeyError):
        Run.of_ports(core(), 10, {**EMPTY.tables, "index_valid": TABLE})


def test_runs_and_tables_are_compared_by_compare_alone() -> None:
    """Arrays have no truth as a whole, so == is whether it is the same object."""
    assert EMPTY == EMPTY != Run(10, EMPTY.tables)
    assert TABLE == TABLE != TABLE.having()
    assert len({EMPTY, TABLE}) == 2


def test_runs_of_other_ports_cannot_be_compared() -> None:
    other = Run(10, EMPTY.tables | {"tick": TABLE.having(age=np.zeros(3))})
    for expected, actual in ((EMPTY, other), (other, EMPTY)):
        with pytest.raises(ValueError, match=r"^runs must be of the same ports, not \{'tick': "):
            compare(expected, actual)
