"""Claims that the command has written become tables of the page."""

from pathlib import Path

from support.script import load


def test_each_figure_has_its_claims(tmp_path: Path) -> None:
    claims, page = tmp_path / "claims.csv", tmp_path / "page.md"
    claims.write_text("figure,source,paper,found,agrees\none,A,says,|1|,yes\none,A,too,2,no\ntwo,B,more,3,yes\n")
    page.write_text("<!-- one -->\n<!-- end of one -->\n<!-- two -->\n<!-- end of two -->\n")
    (tmp_path / "figures").mkdir()
    for name in ("one.png", "two.png"):
        (tmp_path / name).write_text(name)
    load("figures").main([str(claims), "-o", str(page)])
    rows = [line for line in page.read_text().splitlines() if line.startswith("| ") and "---" not in line]
    assert [(tmp_path / "figures" / name).read_text() for name in ("one.png", "two.png")] == ["one.png", "two.png"]
    head = "| the paper says | computed | agrees |"
    assert rows == [head, "| says | 1 | yes |", "| too | 2 | no |", head, "| more | 3 | yes |"]
