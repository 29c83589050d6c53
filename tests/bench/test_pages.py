"""How the benchmarks write the docs."""

import re
from pathlib import Path

import pytest
from support.docs import DOCS
from support.script import load

pages = load("pages")


def test_page_is_replaced_as_a_whole(tmp_path: Path) -> None:
    file = tmp_path / "docs" / "measured" / "size.md"
    for text in ("old", "new"):
        pages.write(file, text)
    assert file.read_text() == "new"
    assert [found.name for found in file.parent.iterdir()] == ["size.md"]


def test_a_block_of_a_page_is_replaced(tmp_path: Path) -> None:
    file = tmp_path / "page.md"
    file.write_text("words\n<!-- one -->\n<!-- end of one -->\n<!-- two -->\nold\n<!-- end of two -->\nmore\n")
    pages.write_block(file, "two", "new\n")
    pages.write_block(file, "one", "first\n")
    assert file.read_text() == (
        "words\n<!-- one -->\nfirst\n<!-- end of one -->\n<!-- two -->\nnew\n<!-- end of two -->\nmore\n"
    )
    with pytest.raises(ValueError, match="unpack"):
        pages.write_block(file, "three", "")


def test_rows_of_a_table_are_replaced_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "one.csv"
    for commit, rows, merge in (("a", ["s", "m"], False), ("b", ["m", "t"], True)):
        monkeypatch.setattr(pages, "commit", lambda commit=commit: commit)
        pages.write_table(file, [["core", "n"], *([name, "1,000"] for name in rows)], merge)
    assert file.read_text().split() == ["core,n,commit", 's,"1,000",a', 'm,"1,000",b', 't,"1,000",b']


def test_the_page_of_evidence_has_what_its_tables_have() -> None:
    """If this fails, run `python bench/evidence.py`."""
    evidence = load("evidence")
    assert pages.block(evidence.PAGE, "summary") == evidence.summary()


def test_the_site_has_every_page_once() -> None:
    shown = re.findall(r": (\w+/[\w-]+\.md)$", (DOCS.parent / "mkdocs.yml").read_text(), re.MULTILINE)
    assert sorted(shown) == sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md"))
