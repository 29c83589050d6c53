"""No page and no picture is older than what it shows."""

import json
import re
from pathlib import Path

import made_of
import pages
import pytest
from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from support.nightly import only

SIZE = "docs/measured/tables/size.csv"
STAMPS = json.loads(pages.STAMPS.read_text(encoding="utf-8"))
ROWS = [one.name for one in made_of.CONFIGURATIONS]
# Cores that differ from another row in numbers, or in what another method has as well.
LIKE_OTHERS = re.compile(
    "axes-(1|32|8-.*|track-32|track-64)|.+-external-tick|track-wide|loop-.*l|frac-bits.*|position-16|x1|rpm|long|paper"
    "|.+-tick|no-cancel|index-reset|compare-both|every-clock-rad|velocity-16|.+-exact|m-10|[a-z]+-bounds|bus-(a|w|n).*"
    "|default|m|t|mt|rairan"
)
# As a whole, by tests of their own.
PAGES = ("compare", "encoder", "evidence", "figures", "size", "sweep")
RECOMPUTED = {f"tables/{name}.csv" for name in ("imperfections", "papers", "single")} | {f"{name}.md" for name in PAGES}
# Speeds, routings, proofs and samples of wrong cores.
TABLES = (
    "disc engines estimate golden mutation proofs upsets verify verify-every-clock verilog-cells verilog-clocks whole"
)
RUNS = {f"{page}.md" for page in ("angle", "control", "estimate", "health", "verilog")}
RUNS |= {f"tables/{name}.csv" for name in TABLES.split()}
OTHERS = {f"docs/measured/{name}" for name in RECOMPUTED | RUNS}
OTHERS |= {"docs/demo.png", "docs/guides/disc.png"}  # drawn by tests/test_readme.py and test_calibrate.py
OTHERS |= {"docs/measured/encoder.svg", "docs/overview.svg", "docs/guides/wiring.svg"}  # drawn by a test, by hand


def parts(file: str) -> list[str]:
    """Return the parts of a file that have a hash: rows of sizes, else blocks, else the whole."""
    text = (pages.ROOT / file).read_text(encoding="utf-8") if file.endswith(".md") else ""
    return ROWS if file == SIZE else re.findall("<!-- end of (.+) -->", text) or [""]


@pytest.mark.parametrize("file", [file for file in made_of.MADE_OF if file != SIZE])
def test_file_is_not_older_than_what_it_shows(file: str) -> None:
    """If this fails, run the command that writes the file: CONTRIBUTING.md has all."""
    for part in parts(file):
        assert STAMPS.get(f"{file} {part}".strip()) == pages.hash_of(file, part), f"{file} {part} is too old"


@pytest.mark.parametrize("row", only([row for row in ROWS if not LIKE_OTHERS.fullmatch(row)], ROWS))
def test_size_is_that_of_the_core(row: str) -> None:
    """If this fails, run `python bench/size.py --update --only NAME`."""
    assert STAMPS.get(f"{SIZE} {row}") == pages.hash_of(SIZE, row)


def test_every_page_and_picture_has_its_hashes() -> None:
    pictures = [one for folder in ("docs", "docs/guides") for one in (pages.ROOT / folder).glob("*.[ps][nv]g")]
    measured = [one for one in pages.MEASURED.rglob("*.*") if one != pages.STAMPS]
    files = {one.relative_to(pages.ROOT).as_posix() for one in (*pictures, *measured)}
    assert files | {"README.md"} == made_of.MADE_OF.keys() | OTHERS
    assert STAMPS.keys() == {f"{file} {part}".strip() for file in made_of.MADE_OF for part in parts(file)}


class Sum(wiring.Component):  # type: ignore[misc]
    """A register with the sum of two inputs."""

    def __init__(self, name: str = "sum", ports: str = "ab", init: int = 0, minus: bool = False) -> None:
        self.name, self.init, self.minus = name, init, minus
        super().__init__({port: In(4) for port in ports} | {"o": Out(4)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules[self.name] = inner = Module()
        total = Signal(4, name=self.name, init=self.init)
        inner.d.sync += total.eq(self.a - self.b if self.minus else self.a + self.b)
        m.d.comb += self.o.eq(total)
        return m


def test_a_netlist_has_no_names_and_no_order_of_ports() -> None:
    first = made_of.netlist(Sum())
    assert [made_of.netlist(one) for one in (Sum("other"), Sum(ports="ba"))] == [first, first]
    assert first not in [made_of.netlist(one) for one in (Sum(init=1), Sum(minus=True))]


def test_a_block_that_is_written_gets_its_hash_and_the_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name, path in (("ROOT", tmp_path), ("MEASURED", tmp_path), ("STAMPS", tmp_path / "made_of.json")):
        monkeypatch.setattr(pages, name, path)
    monkeypatch.setattr(made_of, "MADE_OF", {"page.md": lambda part: part})
    pages.STAMPS.write_text('{"other": "1"}')
    for name in ("page.md", "other.md"):
        (tmp_path / name).write_text("<!-- one -->\n<!-- end of one -->\n")
        for commit in ("12ab", "34cd+"):
            monkeypatch.setattr(pages, "commit", lambda commit=commit: commit)
            pages.write_block(tmp_path / name, "one", "text\n")
        assert (tmp_path / name).read_text().endswith("<!-- end of one -->\n\nLast measured at commit 34cd+.\n")
        assert (tmp_path / name).read_text().count("Last measured") == 1
    assert json.loads(pages.STAMPS.read_text()) == {"other": "1", "page.md one": pages.hash_of("page.md", "one")}
