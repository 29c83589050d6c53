"""All methods and what others use, in several situations: writes docs/measured/compare.md.

First a table of all situations, with rivals tuned for each; then a table and a command for each of some.
"""

import argparse
import csv
import os
import re
import shlex
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path

import situations
from pages import markdown, stamp, write

from tachometry.cli.main import main as tachometry

PAGE = Path(__file__).resolve().parent.parent / "docs" / "measured" / "compare.md"
FIGURE = PAGE.with_name("compare.png")
CORE = "--ppr 500 --clock 10MHz --tick 100us --max-time 10ms --max-speed 400rad/s"


# All, and M/T with windows of 1 ms, as long as those of S at high speed and of what reads the encoder every 1 ms.
WITH_LONG_MT = "s,m,t,mt,mt:min-time=1ms,rairan,track,difference,hostmot2,simplefoc,odrive,moteus"


@dataclass(frozen=True)
class Situation:
    """Describes a comparison: its title, its remark, and the options of the command, those of the core first."""

    title: str
    text: str
    options: str
    core: str = CORE

    @property
    def command(self) -> str:
        """The command whose table it is."""
        return f"tachometry compare {self.core} {self.options}"


SITUATIONS = (
    Situation(
        "The paper's experiment",
        """The encoder has 500 counts per revolution. The tick is 1 ms, and it is also the unit of time of T and
M/T. This is the setting that the S method was made for. S has half the error of M and of M/T in the same
measurement time. T has no value above the unit velocity. The baselines are not bound to the lattice, so
LinuxCNC's timestamps of 0.5 µs are the best by far.""",
        "--methods s,m:average=4,t:timer=tick,mt:timer=tick:min-time=3ms,rairan,hostmot2,simplefoc,odrive "
        "--motion ramp:0:40rad/s:5s --from 100ms --vibration 1mrad:50Hz --seed 1",
        "--ppr 500 --decoding 1 --clock 50kHz --tick 1ms --max-time 10ms --max-speed 60rad/s",
    ),
    Situation(
        "Ramp",
        """Times in clocks of 0.1 µs are better than a lattice of 100 µs. Tracking and the
Kalman filters with acceleration (`kf-ca`, `imm`) do not lag behind a ramp, and have the least errors. Least squares
over 16 edges, M/T (T_c is a tick) and T are next, before LinuxCNC's timestamps. The tracking loops lag by a constant
2 ms. On a lattice of ticks S is the best.""",
        "--motion ramp:0:100rad/s:400ms --from 40ms",
    ),
    Situation(
        "Ramp, real encoder",
        """T measures one count, so its result contains every error of the disc and all jitter. The same is true of
M/T while its windows are short. With windows of 1 ms it is as good as LinuxCNC's timestamps. Methods that
average over more keep their errors and their delays. The memory of the tracking method grows on a ramp
as it does at constant speed, and it learns where the edges of the disc are. Its error is about a hundredth of
theirs.""",
        f"--methods {WITH_LONG_MT} "
        "--motion ramp:0:100rad/s:400ms --from 40ms --jitter 0.05 --nonuniformity 0.1 --phase-error 10 --seed 1",
    ),
    Situation(
        "Reversals",
        """Here delay matters: filters of 5 ms are worse than all others but M. Tracking and the
Kalman filters with acceleration have the least errors, less than half of that of least squares over 16 edges.
LinuxCNC's timestamps and M/T follow.""",
        "--motion sine:50rad/s:5Hz:1s --from 100ms --jitter 0.05 --seed 1",
    ),
)

HEAD = """# Methods beside each other

`make compare` writes this page. It shows the golden models of the cores, which the hardware equals bit
for bit, and float models of what other projects use and of estimators in the literature:

- [all situations](#all-situations) and [others](#other-situations), where every rival has its best setting for each,
  and then [one setting for all](#one-setting-for-all-situations);
- what settings cost, [error over delay](#error-over-delay);
- [the float models](#the-float-models) and their options;
- [single situations](#single-situations) with everything as it comes.

{verdict}
**When to use what**, according to the tables below:

- *Tracking* (`--method track`): use it if the tick has 852 clocks (264 with a multiplier of the FPGA), and 800 cells
  and block RAMs are free. It has no settings. Of our cores it has the smallest error, except with faulty lines. It also
  outputs the acceleration and the position between counts.
- *S*: use it if there is no timer faster than the tick, or if ticks are shorter than 18 µs, down to a clock; it is the
  smallest but for M, it has no divider, and its steady error is least around multiples of the unit velocity. After
  a step to just such a speed it shows the speed before for the maximum time, though
  ([S](../concepts/s-method.md#what-it-measures)). Ticks should be long: its error at more than a count per tick is a
  part of the unit velocity.
- *M/T*: use it if a fast timer and a divider are available, and bounds of the speed are wanted or half of the area of
  tracking. A longer `--min-time` gives less noise and more delay, as averaging does. On a lattice (`--timer tick`) it
  equals M at high speeds.
- *T*: it equals M/T at slow speeds and sudden stops, with less logic. It suffers most from an uneven disc and from
  jitter.
- *Rairán*: use it if bounds of the speed and a constant value at constant speed matter more than the error, which is up
  to 1/3 at ω_lim.
- *M*: use it if nothing else fits, or if its noise is filtered anyway.
- *LinuxCNC's timestamps* (counts over the time between the latest counts, as M/T): they are nearly always good where
  1 ms is fast enough and software divides.
- *Tracking loops* (ODrive, moteus): they are smooth, with a delay that is constant and known, 2 ms with their defaults.
- *Filtered differences, SimpleFOC*: they are good at constant speed, and have 5 ms of delay everywhere else.
- *Least squares and Kalman filters on edges* (float): use them if software has the time of every edge and each drive
  can be tuned. The first table has the best setting for each row, the one with one setting for all what is left of it.

"""


# Of the figure: a real disc at constant speed.
COSTS = (
    "--methods all --motion constant:100rad/s:400ms --from 100ms "
    "--jitter 0.05 --nonuniformity 0.1 --phase-error 10 --seed 1"
)
ABOUT_COSTS = """## Error over delay

At constant speed the slowest filter is the best, and on a fast sine the fastest. The figure shows what each method can
be in between. Upwards is the RMS error with a real disc at 100 rad/s. To the right is the *equivalent delay*: the RMS
error over the RMS acceleration, while the speed of an ideal encoder goes to and fro between 50 and 100 rad/s, 10 times
a second. A method that is only late has its delay there. A method that follows ramps without a lag pays where the
acceleration changes. Every point is a setting than which no other of the same method has both less error and less
delay; cores without a setting to be tuned are single points.
"""
ABOUT_MODELS = """## The float models

Their options follow the name and a colon, as in `--methods hostmot2:period=500us,kalman:order=3:process-noise=1e5`.
`period` is the control period, at which the encoder is read; a control period begins when a loop reads the value.
`least-squares`, `kf-cv`, `kf-ca` and `imm` use the time of each edge, and have a new value for each read. The process
noise of `kalman` is the standard deviation of the acceleration in rad/s² (order 2) or of its derivative in rad/s³
(order 3). That of the filters on edges is the root of the density of white acceleration in rad/s^1.5 (`kf-cv`) or of
its white derivative in rad/s^2.5 (`kf-ca`; `calm` and `agile` of `imm`). `edge-noise` is the standard deviation of the
place of an edge, in counts. The speed is at most `bound` counts over the time since the latest edge, which the papers
do not have. A noise bound is in counts.
"""
SINGLE = f"""## Single situations

Each table from here on is the output of the command above it. The float models of other projects have the settings that
these come with: they read the encoder every 1 ms, ODrive every 125 µs, moteus every 33 µs; `foaw` and `kalman` read it
every 100 µs.

{textwrap.fill(" ".join(situations.READ.split()), 120)}

The delay is the shift of the true speed that comes closest. It is left out at constant speed, and where noise or an
offset looks like a delay.
"""


def rows(command: str) -> list[dict[str, str]]:
    """Return the table of a command, by method."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.csv"
        try:
            tachometry([*shlex.split(command)[1:], "--csv", str(file)])
        except SystemExit as stop:
            if stop.code:
                raise
        with file.open(encoding="utf-8") as table:
            return list(csv.DictReader(table))


def table(found: list[dict[str, str]]) -> str:
    """Return the same in Markdown."""

    def cell(row: dict[str, str], name: str, scale: float = 1) -> str:
        return f"{scale * float(row[name]):.3g}" if row[name] else ""

    heads = ("method", "updates/s", "longest T_m (ms)", "RMS error (rad/s)", "greatest (rad/s)", "delay (ms)")
    numbers = (("updates_per_second", 1), ("worst_time", 1e3), ("rms_rad_s", 1), ("max_rad_s", 1), ("delay", 1e3))
    return markdown(heads, [(row["name"], *(cell(row, name, scale) for name, scale in numbers)) for row in found])


def section(situation: Situation) -> str:
    """Return a situation's part of the page."""
    options = situation.options.replace(" --motion", " \\\n        --motion")
    shown = f"    tachometry compare {situation.core} \\\n        {options}"
    text = textwrap.fill(" ".join(situation.text.split()), 120)
    return f"## {situation.title}\n\n{text}\n\n{shown}\n\n{table(rows(situation.command))}"


def figure() -> str:
    """Return the part of the page with the figure, which is written as well."""
    command = f"tachometry compare {CORE} {COSTS} --tradeoff docs/measured/{FIGURE.name}"
    rows(command.replace(f"docs/measured/{FIGURE.name}", shlex.quote(str(FIGURE))))
    shown = re.sub(" (?=--(methods|jitter|tradeoff))", " \\\\\n        ", command)
    return f"{ABOUT_COSTS}\n    {shown}\n\n![RMS error over equivalent delay of all methods]({FIGURE.name})\n"


def page(n_seeds: int, jobs: int) -> str:
    """Return the page docs/measured/compare.md."""
    verdict, tables = situations.part(n_seeds, jobs)
    models = f"{ABOUT_MODELS}\n{situations.model_table()}"
    return "\n".join([HEAD.format(verdict=verdict) + tables, figure(), models, SINGLE, *map(section, SITUATIONS)])


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, metavar="N", help="seeds of what is random (%(default)s)")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), metavar="N", help="processes (%(default)s)")
    options = parser.parse_args()
    for name in ("seeds", "jobs"):
        if getattr(options, name) < 1:
            parser.error(f"--{name} must be at least 1, not {getattr(options, name)}")
    write(PAGE, page(options.seeds, options.jobs))
    stamp(PAGE)
    stamp(FIGURE)
    sys.stdout.write(f"written: {PAGE}, {FIGURE}\n")


if __name__ == "__main__":
    main()
