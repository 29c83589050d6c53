"""How the benchmarks write the docs."""

from pathlib import Path

from support.script import load

pages = load("pages")


def test_page_is_replaced_as_a_whole(tmp_path: Path) -> None:
    file = tmp_path / "docs" / "measured" / "size.md"
    for text in ("old", "new"):
        pages.write(file, text)
    assert file.read_text() == "new"
    assert [found.name for found in file.parent.iterdir()] == ["size.md"]


def test_part_of_a_page_is_replaced(tmp_path: Path) -> None:
    file = tmp_path / "bench.md"
    pages.write(file, "first\n")
    for text in ("second\n", "third\n"):
        pages.write_from(file, "## Part", text)
    assert file.read_text() == "first\n\n## Part\nthird\n"
