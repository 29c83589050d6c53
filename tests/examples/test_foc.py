"""The examples of docs/guides/foc.md: a vector that stays aligned with the rotor, in Icarus and in Amaranth."""

import math
import re
import shlex
import subprocess
from pathlib import Path
from typing import Any

import pytest
from support.command import run
from support.nightly import only_rows
from support.simulate import clock_by_clock

PAGE = (Path(__file__).parents[2] / "docs" / "guides" / "foc.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    found = re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)
    return str(found[-1]).replace("\\\n", "")


SOON = ("1.5tick", "12_000", 0, 2)  # while it begins to turn


@pytest.mark.parametrize(
    ("lead", "clocks", "least", "most"),
    only_rows([SOON], [SOON, ("1.5tick", "80_000", 0, 2), ("0clk", "80_000", 3, 5)]),
)
def test_the_vector_stays_aligned(
    lead: str, clocks: str, least: float, most: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(*shlex.split(block("sh").replace("1.5tick", lead))[1:]) == 0
    Path("aligned.v").write_text(block("verilog").replace("80_000", clocks))
    subprocess.run(["iverilog", "-g2012", "-s", "aligned", "aligned.v", "rtl/foc.v"], check=True)
    shown = subprocess.run(["vvp", "a.out"], check=True, capture_output=True, text=True).stdout
    away = re.search(r"within ([\d.]+) degrees", shown)
    assert away is not None, shown
    assert least < float(away[1]) < most


def test_the_voltages_are_those_of_the_rotor() -> None:
    """The angle is 0 when the rotor is aligned, and 2.52 degrees after four counts."""
    names: dict[str, Any] = {"__name__": "foc"}
    exec(block("python"), names)
    counts = [min(max(clock - 1500, 0) // 1000, 4) for clock in range(11_000)]
    rows = [
        {"aligned": clock == 100, "d": 10_000, "q": 1000, "a": count % 4 in (1, 2), "b": count % 4 in (2, 3)}
        for clock, count in enumerate(counts)
    ]
    seen = clock_by_clock(names["InversePark"](), rows, ["alpha", "beta"])
    for clock, expected in ((1500, 0), (10_999, 2.52)):
        angle = math.degrees(math.atan2(seen[clock]["beta"], seen[clock]["alpha"]) - math.atan2(1000, 10_000))
        assert angle == pytest.approx(expected, abs=0.4)
        assert math.hypot(seen[clock]["alpha"], seen[clock]["beta"]) == pytest.approx(10_050, abs=3)
