"""Measures the memory of runs over their ticks, and of replays over the size of their files, and prints it.

The constants of `sim/signals/memory.py` come from here: with --age a core is held as a whole.
"""

import argparse
import os
import subprocess
import sysconfig
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from pages import markdown

from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.captures.text import write_csv
from tachometry.sim.signals.recording import Recording, quadrature

CORE = "--ppr 500 --clock 1MHz"
BENCH = """module bench; timeunit 1us/1us; reg a = 0, b = 0; initial begin $dumpfile("%s"); $dumpvars;
repeat (%d / 2) begin #50 a = ~a; #50 b = ~b; end #25 $finish; end endmodule"""
# clocks of a tick; a lossy encoder whose shaft vibrates has 25,000 edges a second
KINDS = "m,s,t,mt,s --index,m --lost 0.01 --vibration 100mrad:200Hz,m --age".split(",")
TICKS = dict.fromkeys(KINDS, 20) | {"track": 300}


def measured(words: Sequence[str]) -> list[str]:
    """Return the peak memory of a command in MiB, and the seconds of processor time that it takes."""
    child = subprocess.Popen([f"{sysconfig.get_path('scripts')}/tachometry", *words], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    assert not status, words
    return [f"{used.ru_maxrss / 1024:.0f}", f"{used.ru_utime + used.ru_stime:.1f}"]


def over_ticks(name: str, n_ticks: int) -> list[str]:
    """Return the row of a run of a shaft that turns slowly."""
    words = f"simulate --method {name} {CORE} --tick {TICKS[name]}us --motion constant:1rad/s:{n_ticks * TICKS[name]}us"
    return [name, f"{n_ticks:.0e}", "", *measured(words.split())]


def over_size(folder: Path, suffix: str, n: int) -> list[str]:
    """Return the row of a replay of a file with `n` changes, 50 us apart."""
    path, level, times = folder / f"x{suffix}", quadrature(np.arange(n + 1)), np.arange(n + 1, dtype=np.float64)
    recording = Recording.of_level(times / 20_000, level, (n + 0.5) / 20_000)
    if suffix == ".sr":
        write_sr(path, recording.place(1_000_000), 1_000_000)
    elif suffix == ".csv":
        write_csv(path, recording)
    else:
        (folder / "bench.v").write_text(BENCH % (path, n), encoding="ascii")
        os.system(f"cd {folder} && iverilog -g2012 -o bench bench.v && vvp bench -{suffix[1:]} > bench.log")
    size, words = path.stat().st_size, ["replay", str(path), "--method", "s", *CORE.split(), "--tick", "1ms"]
    return [f"replay {suffix}", f"{n:.0e}", f"{size / 1e6:.1f}", *measured(words)]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=10_000_000, help="ticks and changes of the longest runs")
    most = parser.parse_args().most
    runs = [over_ticks(name, n) for name in TICKS for n in (most // 100, most // 10, most)]
    with tempfile.TemporaryDirectory() as folder:
        runs += [over_size(Path(folder), end, most // n) for end in (".vcd", ".csv", ".sr", ".fst") for n in (100, 10)]
    print(markdown(["run", "ticks or changes", "MB of file", "peak, MiB", "CPU s"], runs))
