"""Samples of what pages and pictures show: a second is enough to see that one of them is too old.

`pages.stamp` keeps the hash of a sample in docs/measured/made_of.json; tests/bench/test_made_of.py computes it anew.
"""

import ast
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

import angle
import readme
import verilog
from amaranth.hdl import Fragment
from amaranth.hdl._ir import PortDirection, build_netlist
from amaranth.lib import wiring
from compare import rows
from cores import CONFIGURATIONS as CONFIGURATIONS
from health import EXAMPLES, told
from motions import OTHERS, SITUATIONS
from pages import MEASURED, block, read_table
from pictures import CORE as MONITORED
from pictures import commands
from situations import RIVALS, core, errors
from tracking import errors as tracking_errors
from tracking import rms

from tachometry.boards.monitor.columns import columns
from tachometry.cli.explore import answers
from tachometry.hdl import core_of
from tachometry.spec import METHODS, of_texts
from tachometry.spec.registers.demo import DemoMap

SEED = 1  # no page has it
LOOPS = [file.stem for file in MEASURED.glob("tables/loop-*.csv")]


def netlist(top: wiring.Component) -> list[str]:
    """Return the cells of a core and their connections, without names, comments and the order of ports."""
    directions = {wiring.In: PortDirection.Input, wiring.Out: PortDirection.Output}
    flat = sorted(top.signature.flatten(top), key=lambda port: port[0])
    ports = {"__".join(map(str, path)): (value, directions[member.flow]) for path, member, value in flat}
    cells = build_netlist(Fragment.get(top, None), ports).cells
    return [re.sub(r"'[^' ]*'", "", repr(cell)) for cell in cells]


@cache
def measured_core(name: str) -> tuple[list[str], str]:
    """Return the netlist of a row of size.csv, and the code that changes it."""
    (one,) = (one for one in CONFIGURATIONS if one.name == name)
    return netlist(one.component), ast.unparse(ast.parse(one.after))


@cache
def tracking() -> list[str]:
    """Return error and coverage of the tracking method in all situations."""
    every = [
        tracking_errors(core(situation, "track", {"tick": "20us"}), situation, SEED)
        for situation in (*SITUATIONS, *OTHERS)
    ]
    return [f"{rms(one.core):.7f} {one.covered:.1f}" for one in every]


@cache
def estimates() -> list[object]:
    """Return the errors of all methods in every eighth situation, and those of tracking in all."""
    each = [errors(situation, SEED, (*METHODS, *RIVALS)) for situation in (*SITUATIONS, *OTHERS)[::8]]
    return [tracking(), *({name: f"{error:.6f}" for name, error in one.items()} for one in each)]


def explored() -> list[object]:
    """Return the page of `explore`, and its answers to the first questions."""
    form = answers.answer("options", {}, answers.FUNCTIONS)
    asked = [answers.answer(name, {"options": form["start"]}, answers.FUNCTIONS) for name in ("check", "curves")]
    return [form, asked, [file.read_bytes() for file in sorted(Path(answers.__file__).parent.glob("static/page.*"))]]


def watched() -> list[object]:
    """Return the demo, and the heads of its live view."""
    return [measured_core("demo"), [one.head for one in columns(DemoMap(of_texts("s", MONITORED)))]]


# By file: a sample of a part of it, which is a block, a row, or the whole.
MADE_OF: dict[str, Callable[[str], object]] = {
    "README.md": lambda _: [netlist(core_of(core)) for core in readme.cores().values()],
    "docs/guides/angle.png": lambda _: rows(f"tachometry {commands()['angle.png'].partition(' --plot')[0]}"),
    "docs/guides/explore.png": lambda _: explored(),
    "docs/guides/monitor.svg": lambda _: watched(),
    "docs/guides/sweep.png": lambda _: block(MEASURED / "sweep.md", "errors"),
    "docs/guides/wheel.png": lambda _: estimates(),
    "docs/guides/wheel_methods.png": lambda _: estimates(),
    "docs/measured/tables/boards.csv": lambda _: [measured_core("demo"), measured_core("track")],
    "docs/measured/tables/angle.csv": lambda _: [
        f"{angle.errors(angle.core(one), next(iter(angle.MOTIONS)), SEED)[0]:.6f}" for one in angle.ENCODERS
    ],
    "docs/measured/compare.png": lambda _: estimates(),
    "docs/measured/control.png": lambda _: read_table(MEASURED / "tables" / "loop-gains.csv"),
    **{
        f"docs/measured/figures/{file.name}": lambda _, name=file.stem: [
            row for row in read_table(MEASURED / "tables" / "papers.csv") if row["figure"] == name
        ]  # type: ignore[misc]
        for file in MEASURED.glob("figures/*.png")
    },
    **{
        f"docs/measured/tables/health-{name}.csv": lambda _: [f"{told(one, SEED):.7f}" for one in EXAMPLES]
        for name in ("clean", "faults")
    },
    "docs/measured/tables/size.csv": measured_core,
    "docs/measured/tables/verilog.csv": lambda _: [
        re.sub("//.*", "", verilog.core(kind)[2][1]) for kind in ("s", "mt")
    ],
    "docs/measured/tables/toggles.csv": lambda _: [measured_core(name) for name in ("reference", "table")],
    **{f"docs/measured/tables/{name}.csv": lambda _: estimates() for name in ("compare", "one-setting", "settings")},
    # tests/cli/commands/test_loop_docs.py has the loops about S
    **{f"docs/measured/tables/{name}.csv": lambda _: tracking() for name in ("alarms", "tracking", *LOOPS)},
}
