"""Measures the memory of runs over their ticks, and of replays over the size of their files, and prints it.

The constants of `sim/signals/memory.py` come from here: the last core is one that is held as a whole.
"""

import argparse
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from pages import Rows, markdown

CORE = "--ppr 500 --clock 1MHz"
TICKS = {"m": 20, "s": 20, "t": 20, "mt": 20, "track": 300, "m --age": 20}  # clocks; the last is held as a whole
COLUMNS = ["run", "ticks or changes", "MB of file", "peak, MiB", "s"]


def measured(words: Sequence[str]) -> list[str]:
    """Return the peak memory of a command in MiB, and its seconds; CalledProcessError if it fails."""
    command = [f"{sysconfig.get_path('scripts')}/tachometry", *words]
    code = "import subprocess as s, resource as r, sys; s.run(sys.argv[1:], check=True, stdout=s.DEVNULL)"
    code += "; print(r.getrusage(r.RUSAGE_CHILDREN).ru_maxrss)"
    begun = time.monotonic()
    peak = subprocess.run([sys.executable, "-c", code, *command], stdout=subprocess.PIPE, text=True, check=True).stdout
    return [f"{int(peak) / 1024:.0f}", f"{time.monotonic() - begun:.1f}"]


def over_ticks(name: str, n_ticks: int) -> list[str]:
    """Return the row of a run of a shaft that turns slowly."""
    words = f"simulate --method {name} {CORE} --tick {TICKS[name]}us --motion constant:1rad/s:{n_ticks * TICKS[name]}us"
    return [name, f"{n_ticks:.0e}", "", *measured(words.split())]


def over_size(folder: Path, suffix: str, n: int) -> list[str]:
    """Return the row of a replay of a file with `n` changes, 50 us apart."""
    path, levels = folder / f"x{suffix}", ((0, 0), (1, 0), (1, 1), (0, 1))
    with path.open("w", encoding="ascii") as file:
        if suffix == ".vcd":
            file.write("$timescale 1 us $end $var wire 1 ! a $end $var wire 1 $ b $end $enddefinitions $end\n")
            file.write("#0\n0!\n0$\n")
            file.writelines(f"#{50 * k}\n{levels[k % 4][k + 1 & 1]}{'$!'[k & 1]}\n" for k in range(1, n + 1))
        else:
            file.write("time_us,a,b\n")
            file.writelines(f"{50 * k},{levels[k % 4][0]},{levels[k % 4][1]}\n" for k in range(n + 1))
    found = measured(["replay", str(path), "--method", "s", *CORE.split(), "--tick", "1ms"])
    return [f"replay {suffix}", f"{n:.0e}", f"{path.stat().st_size / 1e6:.1f}", *found]


def table(ticks: Sequence[int], changes: Sequence[int]) -> Rows:
    """Return all rows."""
    with tempfile.TemporaryDirectory() as folder:
        files = [over_size(Path(folder), suffix, n) for suffix in (".vcd", ".csv") for n in changes]
    return [COLUMNS, *(over_ticks(name, n) for name in TICKS for n in ticks), *files]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=10_000_000, help="ticks and changes of the longest runs")
    most = parser.parse_args().most
    heads, *body = table([most // 100, most // 10, most], [most // 100, most // 10])
    print(markdown(heads, body))
