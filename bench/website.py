"""Makes the site in build/www: the pages of docs/, with a search that needs no service but the server of the files."""

import html
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES, SITE, PAGE = (ROOT / "build" / name for name in ("pages", "www", "page"))  # PAGE is that of `make page`


def lay_out() -> None:
    """Put all pages where mkdocs.yml finds them: those of docs/, and what lies beside it; without links to tests."""
    shutil.rmtree(PAGES, ignore_errors=True)
    shutil.copytree(ROOT / "docs", PAGES)
    shutil.copytree(ROOT / "examples", PAGES / "examples", ignore=shutil.ignore_patterns("papers"))
    for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "LICENSE"):
        shutil.copy(ROOT / name, PAGES / name.replace("README", "index"))
    for page in PAGES.rglob("*.md"):
        text = page.read_text(encoding="utf-8").replace("](../../", "](../").replace("](docs/", "](")
        text = re.sub(r"\[([^]]*)\]\(\.\./tests/[^)]*\)", r"\1", text)
        text = re.sub(r"`([^`\n]*\\\|[^`\n]*)`", _in_cell, text)
        if page == PAGES / "index.md" and PAGE.exists():
            text = re.sub(
                r"(?m)^# .*\n",
                r"\g<0>\n[Configure a core in the browser](explore/index.html){ .md-button .md-button--primary }\n",
                text,
                count=1,
            )
        page.write_text(re.sub(r"\bREADME\.md", "index.md", text), encoding="utf-8")


def _in_cell(code: re.Match[str]) -> str:
    """Return code in a cell of a table, whose bars have backslashes in Markdown, which would be seen."""
    return f"<code>{html.escape(code[1])}</code>".replace("\\|", "&#124;")


def build() -> str:
    """Build the site; what Zensical has said.

    It raises RuntimeError if it has a warning, such as a dead link.
    """
    lay_out()
    words = [str(Path(sys.executable).with_name("zensical")), "build", "--clean", "--strict"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    if done.returncode or "No issues found" not in said:
        raise RuntimeError(said)
    if PAGE.exists():
        shutil.copytree(PAGE, SITE / "explore")
    return said


if __name__ == "__main__":
    build()
    print(f"python3 -m http.server -d {SITE.relative_to(ROOT)} shows it at http://localhost:8000")
