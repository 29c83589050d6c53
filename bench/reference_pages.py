"""Writes the pages of docs/reference from what the code declares."""

import inspect
import re
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

from pages import ROOT, data, filled, markdown, write

from tachometry import api
from tachometry.boards.fpga.boards import BOARDS
from tachometry.cli.commands import COMMANDS, load
from tachometry.cli.options.option import Option
from tachometry.hdl.export.registers.files import tables
from tachometry.sim.studies.sweeping.sweep import COLUMNS
from tachometry.spec import METHODS, Port, TachometerSpec, of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.ports import loop_ports
from tachometry.spec.core.extras.stream import Stream
from tachometry.spec.language.field import Register
from tachometry.spec.registers.buses import BUSES
from tachometry.spec.registers.loop import LoopMap
from tachometry.spec.registers.map import RegisterMap

DOCS = ROOT / "docs" / "reference"
CORES: dict[str, dict[str, str]] = data("reference")
SPEED = CORES["registers"]
_LOOP = LoopSpec(tachometer=of_texts("s", CORES["loop"]))
_STREAM = of_texts("track", CORES["loop"] | {"stream": "axi"})


def options() -> str:
    """Return the page of all options: a table for each command, and each group under the first command that has it."""
    parts = [filled("options.md")]
    seen: set[str] = set()
    for name, command in ((name, load(name)) for name in COMMANDS):
        parts.append(f"## tachometry {name}\n\n{COMMANDS[name]}\n")
        groups: dict[str, list[list[str]]] = {}
        with command.make_context(name, [], resilient_parsing=True) as context:
            for parameter in command.get_params(context):
                if isinstance(parameter, Option) and (record := parameter.get_help_record(context)) is not None:
                    row = [f"`{record[0]}`".replace("|", "\\|"), " ".join(record[1].split()).replace("|", "\\|")]
                    groups.setdefault(parameter.group, []).append(row)
        known = [group for group, rows in groups.items() if repr((group, rows)) in seen]
        table = [row for group, rows in groups.items() if group not in known for row in ([f"**{group}**", ""], *rows)]
        parts.append(markdown(["option", "meaning"], table, left=(0, 1)))
        seen |= {repr(item) for item in groups.items()}
        if known:
            parts.append(f"And, as above: {', '.join(known)}.\n")
    return "\n".join(parts)


def ports() -> str:
    """Return the page of all ports of all methods."""
    found: dict[str, Port] = {}
    has: dict[str, dict[str, None]] = {}
    own = {method: {port.name: port.help for port in of_texts(method, {"ppr": "500"}).ports} for method in METHODS}
    always = {name for helps in own.values() for name in helps}
    every = [(method, port) for method in METHODS for spec in _cores(method) for port in spec.ports]
    for method, port in every:
        found.setdefault(port.name, port)
        has.setdefault(port.name, {})[method] = None
    rows = []
    for name, port in found.items():
        only = "" if len(has[name]) == len(METHODS) else f" Methods: {', '.join(has[name])}."
        *cells, meaning = _described(port)
        if name in ("interval", "forced"):
            texts = {helps[name]: [one for one in own if own[one][name] == helps[name]] for helps in own.values()}
            meaning = " ".join(f"{text.rstrip('.')} ({', '.join(methods)})." for text, methods in texts.items())
        rows.append([*cells, meaning + only + ("" if name in always else " Only with its option.")])
    alone = {port.name for port in _STREAM.ports} - {port.name for port in replace(_STREAM, extras=()).ports}
    kinds, stream = ("unsigned", "signed"), Stream.of(_STREAM.extras)
    assert stream is not None
    record = [[f"`{one.name}`", str(one.offset), str(one.size), kinds[one.signed]] for one in stream.parts(_STREAM)]
    return filled(
        "ports.md",
        ports=_table(rows),
        streamed=_table(_described(port) for port in _STREAM.ports if port.name in alone),
        record=markdown(["number", "byte", "bytes", "kind"], record, left=[0, 3]),
        loop=_table(map(_described, loop_ports(_LOOP))),
        generator=_table(map(_described, _beyond(command="generator"))),
        gains=_table(map(_described, _beyond(gains="inputs"))),
    )


def _table(rows: Iterable[list[str]]) -> str:
    return markdown(["port", "when", "kind", "meaning"], [*rows], left=range(4))


def _beyond(**options: Any) -> list[Port]:
    """Return ports that options of a loop add, or make of others."""
    there = {port.name: port.direction for port in loop_ports(_LOOP)}
    return [port for port in loop_ports(replace(_LOOP, **options)) if there.get(port.name) != port.direction]


def _described(port: Port) -> list[str]:
    """Return a row of the table of ports."""
    kind = "strobe" if port.is_strobe else f"with `{port.held_by}`" if port.held_by else port.direction
    width = "signed" if port.signed else "1 bit" if port.width == 1 else "unsigned"
    return [f"`{port.name}`", kind, width, port.help]


def _cores(method: str) -> list[TachometerSpec]:
    """Return cores that have among them every port of a method."""
    facts, every, place = METHODS[method].facts, {**CORES["everything"]}, CORES["place"]
    if not facts.bounds:
        every.pop("bounds")
    given = [every, place, {name: place[name] for name in ("ppr", "index", "health")}]
    given += [] if facts.own_ticks else [every | {"external-tick": "yes"}]
    given += [{**every, **CORES[method]}] if method in CORES else []
    return [of_texts(method, texts) for texts in given]


def boards() -> str:
    """Return the page of the boards and of their pins."""
    rows = []
    for name, board in BOARDS.items():
        made = "project for the vendor's tools" if board.flow is None else "bitstream"
        rows.append([f"`{name}`", board.title, f"{board.clock_hz // 10**6} MHz", made])
    pins = {board.title.split(",")[0]: board.pins for board in BOARDS.values()}
    names = dict.fromkeys(port for each in pins.values() for port in each)
    of_port = [[f"`{port}`", *(each.get(port, "") for each in pins.values())] for port in names]
    listed = markdown(["name", "board", "clock", "what is made"], rows, left=range(4))
    return filled("boards.md", boards=listed, pins=markdown(["port", *pins], of_port, left=range(len(pins) + 1)))


def columns() -> str:
    """Return the page of the columns of a sweep's results."""
    same = [name for name, (_, about) in COLUMNS.items() if about == "as the option"]
    rows = [[f"`{name}`", kind, about] for name, (kind, about) in COLUMNS.items() if name not in same]
    rows.append([", ".join(f"`{name}`" for name in same), "", "as the options of these names"])
    return filled("columns.md", columns=markdown(["column", "kind", "what it is, unit"], rows, left=range(3)))


def registers() -> str:
    """Return the page of the registers."""

    def shown(registers: Iterable[Register]) -> str:
        return re.sub("^## ", "### ", tables(registers), flags=re.MULTILINE)

    commanded = LoopMap(_LOOP.tachometer, replace(_LOOP, gains="inputs"))
    generating = LoopMap(_LOOP.tachometer, replace(_LOOP, gains="inputs", command="generator"))
    known = {one.name for one in RegisterMap(_LOOP.tachometer)}
    added = [one for one in commanded if one.name not in known]
    known |= {one.name for one in added if not one.name.startswith(("COMMAND", "LOOP"))}
    with_irq = RegisterMap(of_texts("s", SPEED | CORES["irq"]), irq=True)
    alone = {one.name for one in RegisterMap(of_texts("s", {"ppr": "500"}))} - {"CONTROL", "STATUS"}
    place = CORES["place"]
    return filled(
        "registers.md",
        buses="\n".join(f"| `{bus.name}` | {bus.help[0].upper()}{bus.help[1:]} |" for bus in BUSES.values()),
        of_all=shown(RegisterMap(of_texts("s", SPEED))),
        place=" ".join(f"--{name}" + f" {text}" * (text != "yes") for name, text in place.items()),
        of_place=shown(one for one in RegisterMap(of_texts("s", place)) if one.name not in alone),
        of_irq=shown(one for one in with_irq if one.name.startswith("INTERRUPT")),
        of_loop=shown(added),
        of_generator=shown(one for one in generating if one.name not in known),
    )


def functions() -> str:
    """Return the page of `import tachometry`, from its docstrings."""
    return filled("functions.md", functions="".join(map(_function, api.__all__)))


def _function(name: str) -> str:
    """Return the section of a function or class: its docstring, and those of what a class has."""
    made = getattr(api, name)
    summary, _, more = inspect.cleandoc(made.__doc__ or "").partition("\n\n")
    members = vars(made).items() if inspect.isclass(made) else ()
    rows = [
        f"- `{member}`: {' '.join((value.__doc__ or '').split())}\n"
        for member, value in members
        if not member.startswith("_") and (isinstance(value, property) or inspect.isfunction(value))
    ]
    return f"\n## `t.{name}`\n\n{summary}\n\n```text\n{more}\n```\n" + ("\n" if rows else "") + "".join(rows)


if __name__ == "__main__":
    for page in (options, ports, registers, boards, columns, functions):
        write(DOCS / f"{page.__name__}.md", page())
