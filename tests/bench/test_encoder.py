"""The picture and the table of docs/measured/encoder.md are those of the bench, and say what the guide says."""

import inspect
from pathlib import Path

import pages
import pytest
from support import docs
from support.script import load

from tachometry.sim.encoder.virtual import VirtualEncoder

encoder = load("encoder")
PAGE = encoder.PAGE.read_text("utf-8")
GUIDE = docs.page("guides/encoder.md") + docs.page("guides/sensors.md")
PICTURE = encoder.PICTURE.read_bytes()


def test_the_page_is_up_to_date(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(encoder, "PICTURE", tmp_path / "encoder.svg")
    heads, *rows = encoder.imperfections()
    assert [dict(zip(heads, row, strict=True)) for row in rows] == docs.table("imperfections")
    assert encoder.pulse_table() == pages.block(encoder.PAGE, "pulses")
    assert encoder.PICTURE.read_bytes() == PICTURE


def test_every_parameter_is_on_the_page() -> None:
    for name in inspect.signature(VirtualEncoder).parameters:
        assert name in {"pulses_per_rev", "start_angle_rad", "seed", "complemented"} or f"`{name}" in GUIDE, name


def test_what_the_page_says_of_the_core() -> None:
    table = {row[0]: row for row in encoder.table()[1:]}
    off = {option: int(row[1].split()[0]) for option, row in table.items()}
    errors = {option: int(row[2]) for option, row in table.items()}
    for option in table:
        faulty = option in ("--lost 0.01", "--illegal 0.01")
        assert (abs(off[option]) > 200) == faulty
        assert (errors[option] > 100) == (option == "--illegal 0.01")
        assert (int(table[option][3]) > 1000) == ("--filter" in option)
    assert off["--lost 0.01"] % 4 == 0
    assert off["--illegal 0.01"] == -2 * errors["--illegal 0.01"]


def test_what_the_pages_say_of_pulses() -> None:
    rows = [line.strip("| \n").split(" | ") for line in PAGE.split("<!-- pulses -->")[1].splitlines()[3:-1]]
    assert len(rows) == 6
    for disc, _, *cells in rows:
        counts, fine = (float(cell.split(" ± ")[1]) for cell in cells)
        assert fine < counts / 9 if disc == "real" else counts < fine
