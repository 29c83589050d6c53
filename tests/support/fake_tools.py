"""Programs that stand for those of the extra `boards`: they write what they shall, and what they were asked."""

import json
import sys
from pathlib import Path

import pytest

from tachometry.boards.fpga import tools

_PROGRAM = """\
#!{python}
import json, sys
from pathlib import Path
folder, name = Path({folder!r}), Path(sys.argv[0]).name
with (folder / "calls").open("a") as calls:
    calls.write(json.dumps([name, *sys.argv[1:]]) + "\\n")
told = json.loads((folder / "told").read_text()).get(name, {{}})
print(told.get("output", ""))
if told.get("status"):
    sys.exit(told["status"])
words = sys.argv[1:]
for file in [word for word in words if word.startswith("top.") and not Path(word).exists()]:
    Path(file).write_text(name + " " + file)
if "top.ys" in words:
    table = {{"type": "LUT1", "parameters": {{"INIT": "01"}}, "connections": {{}}}}
    for made in ("top.json", "top.syn.json"):
        Path(made).write_text(json.dumps({{"modules": {{"top": {{"ports": {{}}, "cells": {{"t": table}}}}}}}}))
if "--report" in words:
    assert "himbaechel" not in name or "LUT1" not in Path(words[words.index("--json") + 1]).read_text()
    seed = words[words.index("--seed") + 1]
    wanted = float(words[words.index("--freq") + 1])
    clock = {{"achieved": told.get("fmax", {{}}).get(seed, 99.5), "constraint": wanted}}
    used = {{cell: {{"used": used, "available": 2 * used}} for cell, used in told["cells"].items()}}
    Path("report.json").write_text(json.dumps({{"fmax": {{"clk": clock}}, "utilization": used}}))
    Path("route.log").write_text(told.get("logs", {{}}).get(seed, ""))
"""
_CELLS = {
    **{"ICESTORM_LC": 700, "ICESTORM_RAM": 4, "ICESTORM_DSP": 0},
    **{"TRELLIS_COMB": 650, "TRELLIS_FF": 450, "DP16KD": 1, "MULT18X18D": 0},
    **{"LUT4": 600, "ALU": 230, "DFF": 460, "BSRAM": 1},
}


class FakeTools:
    """Programs in a folder, which are the only ones that are found.

    - `names`: Of the programs, with spaces between.
    """

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, names: str) -> None:
        self._folder = folder
        self._told: dict[str, dict[str, object]] = {}
        folder.mkdir()
        for name in names.split():
            program = folder / name
            program.write_text(_PROGRAM.format(python=sys.executable, folder=str(folder)))
            program.chmod(0o755)
            self.tell(name, cells=_CELLS)
        monkeypatch.setattr(tools, "scripts", lambda: str(folder))
        monkeypatch.setattr(tools, "versions", lambda packages: dict.fromkeys(packages, "1.0"))
        monkeypatch.setattr("tachometry.boards.fpga.build.versions", tools.versions)
        monkeypatch.setenv("PATH", "")

    def tell(self, name: str, **told: object) -> None:
        """Set what a program shall do: `status`, `output`, and of nextpnr `fmax` and `logs` by seeds."""
        self._told[name] = self._told.get(name, {}) | told
        (self._folder / "told").write_text(json.dumps(self._told))

    @property
    def calls(self) -> list[list[str]]:
        """Programs that have run, with what they were given."""
        calls = self._folder / "calls"
        return [json.loads(line) for line in calls.read_text().splitlines()] if calls.exists() else []
