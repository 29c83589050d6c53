"""Makes bitstreams of three boards with `tachometry build`, for docs/measured/evidence.md."""

import json
import re
from collections.abc import Mapping

from pages import MEASURED, ROOT, Rows, measure, processor_time, tachometry

from tachometry.boards.fpga.boards import BOARDS

BUILT = ("tang-nano-9k", "icebreaker", "ulx3s-25f")
CORE = ("--ppr", "500", "--max-speed", "1000rad/s", "--filter", "4")
HEADS = ("board", "cells", "Fmax (MHz)", "clock (MHz)", "processor time (s)", "tools")


def row(name: str, printed: str, seconds: float, tools: Mapping[str, str]) -> tuple[str, ...]:
    """Return a row of the table from what the command has printed."""
    rows = [line.split("  ", 1) for line in printed.split("\n\n")[1].splitlines()]
    figures = {key.strip(): value.strip() for key, value in rows}
    cells = ", ".join(f"{value} {key}" for key, value in figures.items() if re.match(r"[1-9][\d,]* of ", value))
    fmax = figures["Fmax"].split(" MHz")[0]
    used = ", ".join(f"{tool} {version}" for tool, version in sorted(tools.items()))
    return BOARDS[name].title, cells, fmax, f"{BOARDS[name].clock_hz / 1e6:g}", f"{seconds:.0f}", used


def built() -> Rows:
    """Return the table of all boards."""
    rows: list[tuple[str, ...]] = [HEADS]
    for name in BUILT:
        folder, begun = ROOT / "build" / name, processor_time()
        printed = tachometry("build", name, *CORE, "-o", folder)
        tools = json.loads((folder / "tachometer.json").read_text(encoding="utf-8"))["board"]["tools"]
        rows.append(row(name, printed, processor_time() - begun, tools))
        print(*rows[-1], sep="  ", flush=True)
    return rows


if __name__ == "__main__":
    measure(MEASURED / "evidence.md", {"boards": built})
