"""Makes bitstreams of three boards with `tachometry build`, and writes their figures into docs/measured/boards.md.

Exit codes: 0, 2 if a bitstream cannot be made.
"""

import argparse
import json
import re
import resource
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path

from pages import markdown, write_block

from tachometry.boards.fpga.boards import BOARDS

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "measured" / "boards.md"
BUILT = ("tang-nano-9k", "icebreaker", "ulx3s-25f")
CORE = ("--ppr", "500", "--max-speed", "1000rad/s", "--filter", "4")
HEADS = ("board", "cells", "Fmax (MHz)", "clock (MHz)", "processor time (s)")


def figures(name: str, folder: Path) -> tuple[str, ...]:
    """Build a bitstream with the command, and read what it prints: a row of the table.

    It raises RuntimeError if it cannot be built.
    """
    command = Path(sysconfig.get_path("scripts")) / "tachometry"
    begun = _processor_time()
    done = subprocess.run([command, "build", name, *CORE, "-o", folder], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{name}: {done.stderr.strip()}")
    return row(name, done.stdout, _processor_time() - begun)


def _processor_time() -> float:
    """Return seconds that programs took which this one has run, whatever else the machine did meanwhile."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def row(name: str, said: str, seconds: float) -> tuple[str, ...]:
    """Return a row of the table from what the command has printed."""
    rows = [line.split("  ", 1) for line in said.split("\n\n")[1].splitlines()]
    told = {key.strip(): value.strip() for key, value in rows}
    cells = ", ".join(f"{value} {key}" for key, value in told.items() if re.match(r"[1-9][\d,]* of ", value))
    fmax = told["Fmax"].split(" MHz")[0]
    return BOARDS[name].title, cells, fmax, f"{BOARDS[name].clock_hz / 1e6:g}", f"{seconds:.0f}"


def block(rows: Sequence[tuple[str, ...]], tools: dict[str, str]) -> str:
    """Return the table, and the versions of the tools."""
    used = ", ".join(f"{name} {version}" for name, version in sorted(tools.items()))
    return f"{markdown(HEADS, rows, left=(0, 1))}\nTools: {used}.\n"


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=PAGE, help="page whose figures are replaced")
    page_of = parser.parse_args(words).output
    rows: list[tuple[str, ...]] = []
    tools: dict[str, str] = {}
    try:
        for name in BUILT:
            folder = ROOT / "build" / name
            rows.append(figures(name, folder))
            print(*rows[-1], sep="  ", flush=True)
            tools |= json.loads((folder / "tachometer.json").read_text(encoding="utf-8"))["board"]["tools"]
    except RuntimeError as error:
        print(error, file=sys.stderr)
        return 2
    write_block(page_of, "boards", block(rows, tools))
    return 0


if __name__ == "__main__":
    sys.exit(main())
