"""docs/measured/compare.md: its tables are what is measured now."""

import re
from typing import Any

import pytest
from support import docs
from support.nightly import nightly, only
from support.script import load

page = load("compare")
situations = load("situations")
DOCS = page.PAGE.read_text(encoding="utf-8")


def row(table: str, situation: str) -> dict[str, str]:
    """Return a row of a table beside the page."""
    (found,) = (row for row in docs.table(table) if row.pop("situation") == situation)
    return found


def test_the_page_has_what_its_tables_have() -> None:
    for name, text in page.blocks().items():
        assert f"<!-- {name} -->\n{text}<!-- end of {name} -->" in DOCS


@pytest.mark.parametrize("situation", page.SITUATIONS, ids=lambda situation: situation.title)
def test_table_of_a_situation(situation: Any) -> None:
    """Methods that the table does not have yet may be added; those that it has must have these numbers."""
    assert " ".join(situation.command.split()) in " ".join(DOCS.replace("\\", "").split())
    shown = [[*row.values()][1:] for row in docs.table("single") if row["situation"] == situation.title]
    assert len(shown) >= 6
    found = page.table(page.rows(situation.command))
    assert [one for one in found if one[0] in [name for name, *_ in shown]] == shown


NOT_RANDOM = [situation for situation in situations.SITUATIONS if not situation.random]


@pytest.mark.parametrize("situation", only(NOT_RANDOM[:1], NOT_RANDOM), ids=lambda situation: situation.name)
def test_row_of_all_situations(situation: Any) -> None:
    """Of those that take one seed; some errors are nothing but rounding, which is that of the machine."""
    columns = (*situations.OURS, *situations.RIVALS)
    (found,) = situations.best(situations.measured([situation], 10, 1, columns), columns).values()
    shown = [float(cell) for cell in row("compare", situation.name).values()]
    assert [cell.mean for cell in found] == pytest.approx(shown, rel=0.01, abs=1e-7)
    assert all(cell.spread is None for cell in found)


@nightly  # with all seeds of the page
@pytest.mark.parametrize("name", ["slow sine, real", "stop, real"])
def test_row_of_one_setting_for_all(name: str) -> None:
    ((first, last),) = re.findall(r"over seeds (\d+) to (\d+)", DOCS)
    assert int(first) == situations.FIRST_SEED
    (situation,) = [one for one in situations.SITUATIONS if one.name == name]
    columns, shown = ["hostmot2", "mt", *situations.OURS], row("one-setting", name)
    assert (*shown,)[: len(situations.OURS)] == situations.OURS
    table = situations.measured([situation], int(last) - int(first) + 1, 1, columns)[name]
    checked = {head: str(table[head]) for head in shown if head in table}
    assert len(checked) >= len(columns)
    assert checked.items() <= shown.items()


def test_options_of_the_models_are_on_the_page() -> None:
    assert situations.model_table() in DOCS
    every = {situation.name: situation.options for situation in (*situations.SITUATIONS, *situations.OTHERS)}
    assert {one["situation"]: one["options"] for one in docs.table("settings")} == every


def test_the_page_names_where_others_are_better() -> None:
    found = page.errors_of("compare")
    assert [*found] == [situation.name for situation in (*situations.SITUATIONS, *situations.OTHERS)]
    worse = [name for name, over in situations.wins(found).items() if over > 1.1]
    assert [name for name in worse if f"| {name} | " not in DOCS.split("<!-- end of verdict -->")[0]] == []


def cell(name: str, *errors: float) -> Any:
    return situations.Cell.of(name, list(errors))


def test_the_best_has_the_least_mean_and_one_for_all_the_least_product(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(situations, "settings", lambda method: ["x", "x:a=1", "x:a=2", "x:a=3"])
    table = {
        "1": {"x": cell("x", 4, 6), "x:a=1": cell("x:a=1", 1, 3), "x:a=2": cell("x:a=2", 9, 9)},
        "2": {"x": cell("x", 2), "x:a=1": cell("x:a=1", 8), "x:a=2": cell("x:a=2", 1e-9), "x:a=3": cell("x:a=3", 3)},
    }
    found = situations.best(table, ["x"])
    assert [row[0].name for row in found.values()] == ["x:a=1", "x:a=2"]
    assert [str(row[0]) for row in found.values()] == ["2 ± 1", "1e-09"]
    assert situations.single(table, "x") == "x:a=2"  # 9 times the least that counts
    table["1"]["x:a=2"] = cell("x:a=2", 2000)
    assert situations.single(table, "x") == "x"  # and x:a=3 cannot be everywhere
    shown = situations.error_table(["`x`"], found)
    assert shown[1] == ["1", "2 ± 1"]
    assert situations.setting_table(found)[1] == ["1", "", "a=1"]


def test_processes_find_what_one_finds() -> None:
    some = situations.SITUATIONS[-2:]
    alone, together = (situations.measured(some, 2, jobs, ["hostmot2"]) for jobs in (1, 2))
    assert alone == together
    assert [len(table) for table in alone.values()] == [9, 9]
    assert [next(iter(table.values())).spread is None for table in alone.values()] == [True, False]
