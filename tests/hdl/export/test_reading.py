"""The guide to the exported Verilog quotes the file that its command writes."""

import re
from pathlib import Path

from support import docs
from support.command import run

PAGE = docs.page("guides/reading-the-verilog.md")


def test_the_guide_quotes_the_file(tmp_path: Path) -> None:
    command = re.search(r"^tachometry (generate .*) -o build$", PAGE, re.MULTILINE)
    assert command is not None
    assert run(*command[1].split(), "-o", tmp_path) == 0
    text = (tmp_path / "tachometer.v").read_text()
    quoted = re.findall(r"^```verilog\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    assert len(quoted) > 8
    assert [one for one in quoted if one not in text] == []
    # Names in the sentences are those of the file, too.
    named = {name for name in re.findall(r"`([a-z_]\w*)`", re.sub(r"```.*?```", "", PAGE, flags=re.DOTALL))}
    assert {name for name in named if not re.search(rf"\b{name}\b", text)} == set()
