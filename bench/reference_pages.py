"""Writes the pages of docs/reference from what the code declares."""

import inspect
import re
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import click
from pages import markdown, write

from tachometry import api
from tachometry.boards.fpga.boards import BOARDS
from tachometry.cli.commands import COMMANDS, load
from tachometry.cli.options.option import Option
from tachometry.hdl.export.registers.files import tables
from tachometry.sim.studies.sweeping.sweep import COLUMNS
from tachometry.spec import METHODS, Encoder, Port, TachometerSpec, Timing, of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.ports import loop_ports
from tachometry.spec.core.stream import parts_of
from tachometry.spec.registers.buses import BUSES
from tachometry.spec.registers.loop import LoopMap
from tachometry.spec.registers.map import RegisterMap

DOCS = Path(__file__).resolve().parent.parent / "docs" / "reference"
# Cores with all ports that the methods have.
EVERYTHING: dict[str, str | None] = {
    "ppr": "500",
    "index": "yes",
    "filter": "4",
    "age": "yes",
    "bounds": "yes",
    "velocity-width": "20",
}
EXTERNAL = {"external-tick": "yes"}
# What counts on positions, and watches.
PLACE = {
    "ppr": "500",
    "index": "yes",
    "index-once": "yes",
    "preset": "0",
    "position-modulo": "rev",
    "probe": "1",
    "compare": "list:8:1us",
    "health": "yes",
    "over-speed": "100rad/s",
}
# The core whose registers are shown: that of docs/guides/integration.md.
SPEED = {
    "ppr": "2500",
    "max-speed": "4000rpm",
    "clock": "100MHz",
    "tick": "50us",
    "max-time": "10ms",
    "external-tick": "yes",
    "unit": "rpm",
    "lsb": "2^-4",
    "velocity-width": "18",
    "age": "yes",
}
_HEADER = ["port", "when", "kind", "meaning"]
_LOOP = LoopSpec(tachometer=of_texts("s", {"ppr": "500", "max-speed": "1000rad/s"}))
_STREAM = of_texts("track", {"ppr": "500", "max-speed": "1000rad/s", "stream": "axi"})
_OF_PLACES = f"""
## Of positions and of health

The tables are of `{" ".join(f"--{name}" + f" {text}" * (text != "yes") for name, text in PLACE.items())}`,
where offsets are other ones than those above. In C each register that is written has a function, such as
`NAME_write_preset` and `NAME_write_probe_arm`, and fields of CONTROL have `NAME_preset`, `NAME_home` and `NAME_clear`.
In Python these are `client.write("PRESET", -5)` and `client.control("home")`.

"""
_INTERRUPT = """
## An interrupt

With `--irq` a core on a bus has the output `irq`, active high, and these registers behind all others. The table is of
`--index --health --over-speed 3000rpm --irq`; an event has the same bit in each of the three.

- An event waits in INTERRUPTS until 1 is written to its bit of INTERRUPT_CLEAR. One that comes in the clock of the
  write waits on, so none is lost.
- `irq` is high while an event waits whose bit of INTERRUPT_ENABLE is set; after a reset none is. It follows the bit a
  clock later, up and down: a handler that has cleared the last event may see `irq` for one more clock. Events wait also
  while they are not enabled: clear them first.
- `overflow` is a speed beyond `--max-speed`. Of many axes, an event is that of any of them, and STATUS says which.

In C `NAME_enable_interrupts` and `NAME_take_interrupts` of the driver do this.

"""
_OF_LOOPS = """
## Of a control loop

With `--loop --gains inputs` these are added: what the loop shows, its commands and its gains. The tables are of
`--ppr 500 --max-speed 1000rad/s`.

- A write has an effect with the next control tick, if it is two clocks or more before it: in the clock before a control
  tick the loop takes all settings together, and a program that computes a current has one set of them. While
  LOOP.freeze is set, the loop keeps what it has: set it, write what belongs together, and clear it. A position of two
  registers is written so, too. LOOP.enable is never frozen.
- A value beyond what a register can have is held at the nearest that it can, and is read so. A commanded position
  wraps, as positions do.
- No value makes the loop overflow. [Integration](../guides/integration.md#gains-that-can-be-changed) says
  what gains mean.
- Current, filtered velocity and disturbance are those of the last `current_valid`, what a generator commands that of
  the last `control_tick`.

In C, `NAME_regs.h` has what one LSB is: `NAME_GAIN_POSITION_PER_LSB` and so on. In Python,
`tachometry.boards.host.loop` has a client that takes values in their units, and freezes while it writes them:

```python
from tachometry.boards.host.loop import LoopClient

client = LoopClient(read, write, json.load(file))
client.set(gain_position=400, gain_velocity=40, current_limit=8)
client.enable(True)
```

"""
_FUNCTIONS = """\
# Functions for scripts and notebooks

`import tachometry as t` has these; [a drive in Python](../guides/python.md) uses them one after the other. They were
written here from their docstrings by `make docs`, and a test runs their examples.
"""
_REGISTERS = """\
# Registers

`make docs` writes this page from `spec/registers`.

With `--bus` a core has registers: an identification, a control register, counters, and everything that its
[ports](ports.md) show. `tachometry generate` then also writes files that describe them and programs that read them, all
from the same map as the gates.

| file | what it is for |
| --- | --- |
| `NAME.rdl` | SystemRDL 2.0, for PeakRDL and other tools |
| `NAME_regs.h` | C99 and C++11: offsets, masks, resets, the configuration, and what one LSB is |
| `NAME_driver.h` | C99 and C++11: a driver of inline functions, without memory of its own and without a library |
| `NAME_registers.md` | The tables below for your core |
| `NAME.json` | The same for programs, under the key `registers`; `tachometry.boards.host.client` reads it |

| bus | what it is |
| --- | --- |
@BUSES@

## Captures

A capture takes in one clock all that the core shows: the position and whatever else belongs to a tick are of the latest
tick, the velocity and whatever else belongs to an update are of the latest update, and `age` says how many ticks came
after what caused that: a position that `preset` has set is there from the next tick on. Only `swallowed_edges`,
`over_speed`, and what `--health` and `--probe` show are of the clock of the capture. There are two ways to capture:

- Reading VELOCITY, or VELOCITY_LOW where there are two words, captures, and answers with what has just been captured.
  This is enough for one program that polls.
- The input `capture` captures in every clock in which it is high. Let it come from what starts a control period, and
  set `CONTROL.hold`: then reading the velocity does not capture, and all axes show the same moment, however late the
  program reads.

Captured registers keep what they show until the next capture, so a program can take its time. Two programs that read
at the same time, or an input that captures while a program reads, mix two captures. Before the first capture captured
registers read 0. In a capture before the first update of the velocity, the velocity is 0, and whatever else belongs
to an update is not defined.

`STATUS.updated` and `STATUS.indexed` say whether there was something new since the capture before.
`COUNTERS.lost_updates` counts updates of the velocity that no capture has shown. Counters stay at 255. Writing 1 to
`CONTROL.clear` sets all of them to 0, and what the core keeps for `swallowed_edges`,
`over_speed` and `--health`, which later captures show.

A port of several bits has a register of its own, extended to 32 bits by its sign or by zeros, or two of them,
`NAME_LOW` and `NAME_HIGH`, if it is wider. A port of one bit is a flag of `STATUS`; `interval` and `n_ep1` can be so
narrow, too. The core states which registers it has by its configuration, a hash of all that a driver relies on: drivers
and clients read it first, and refuse another core.

## In C

The driver is given two functions that access the bus. In a microcontroller whose bus has the registers at an address:

```c
#include "speed_driver.h"

static uint32_t read_word(void *base, uint32_t offset) {
  return *(volatile uint32_t *)((char *)base + offset);
}

static void write_word(void *base, uint32_t offset, uint32_t value) {
  *(volatile uint32_t *)((char *)base + offset) = value;
}

int measure(void *base, double *rad_per_s, int64_t *position) {
  const struct speed_bus bus = {read_word, write_word, base};
  struct speed_snapshot now;
  if (speed_init(&bus) != SPEED_OK) return -1;
  speed_read(&bus, &now);
  *rad_per_s = speed_rad_per_s(now.velocity);
  *position = now.position;
  return now.stalled;
}
```

## In Python

```python
import json
from tachometry.boards.host.client import Client

with open("rtl/speed.json") as file:
    client = Client(read, write, json.load(file))
now = client.snapshot()
print(now.velocity_rad_per_s, now["position"], now.flags["stalled"], client.counters())
```

`read(offset)` and `write(offset, value)` are your own: whatever brings an access to the bus.

## An example

The core of [integration](../guides/integration.md#an-example-a-servo-drive), with `--age` and `--bus wishbone`.
Offsets are in bytes, and bits that are not listed read 0. Writing a register without a field that can be written is an
error, and so is any access where there is no register.

"""


def options() -> str:
    """Return the page of all options: a table for each command, and each group under the first command that has it."""
    parts = [
        "# Options\n",
        "`make docs` writes this page from what the code declares. "
        "`tachometry COMMAND --help` prints the same. Options of the "
        "groups Encoder, Timing, Core, Method, Motion and Encoder faults mean the same in every command.\n",
    ]
    seen: set[str] = set()
    for name, command in ((name, load(name)) for name in COMMANDS):
        parts.append(f"## tachometry {name}\n\n{COMMANDS[name]}\n")
        groups: dict[str, list[list[str]]] = {}
        with command.make_context(name, [], resilient_parsing=True) as context:
            for parameter in command.get_params(context):
                if isinstance(parameter, Option) and (record := parameter.get_help_record(context)) is not None:
                    groups.setdefault(parameter.group, []).append([_code(record[0]), _cell(record[1])])
        known = [group for group, rows in groups.items() if _key(group, rows) in seen]
        table = [row for group, rows in groups.items() if group not in known for row in ([f"**{group}**", ""], *rows)]
        parts.append(markdown(["option", "meaning"], table, left=(0, 1)))
        seen |= {_key(group, rows) for group, rows in groups.items()}
        if known:
            parts.append(f"And, as above: {', '.join(known)}.\n")
    return "\n".join(parts)


def _key(group: str, rows: list[list[str]]) -> str:
    return repr((group, rows))


def _code(text: str) -> str:
    return f"`{text}`".replace("|", "\\|")


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


def ports() -> str:
    """Return the page of all ports of all methods."""
    found: dict[str, list[str]] = {}
    has: dict[str, list[str]] = {}
    always = {port.name for method in METHODS for port in of_texts(method, {"ppr": "500"}).ports}
    for method in METHODS:
        for spec in _cores(method):
            for port in spec.ports:
                found.setdefault(port.name, _described(port))
                if method not in has.setdefault(port.name, []):
                    has[port.name].append(method)
    rows = []
    for name, (code, kind, width, meaning) in found.items():
        only = "" if len(has[name]) == len(METHODS) else f" Methods: {', '.join(has[name])}."
        rows.append([code, kind, width, meaning + only + ("" if name in always else " Only with its option.")])
    return "\n".join(
        [
            "# Ports\n",
            "`make docs` writes this page from `spec.ports`. A *strobe* is high for one clock; an output *with* a "
            "strobe is new in its clocks, and held until the next, unless its row says more. Widths depend on the "
            "options: the manifest NAME.json has those of your core. Those of many axes are in "
            "[axes](../concepts/axes.md#ports).\n",
            markdown(_HEADER, rows, left=range(4)),
            "\nWith `--bus` and `--irq` there is also the output `irq`, see [registers](registers.md#an-interrupt).\n",
            "\nThe manifest states the latencies: a level sampled at clock c is counted in the window of c + "
            "`pin_to_count`, `tick` is high `tick_latency` clocks after the window's last clock, and `velocity_valid` "
            "`tick_to_velocity` clocks after `tick`.\n",
            "## Of a stream\n",
            "With `--stream` a core has these as well. The second table has the numbers of a record of `track`, "
            "little-endian; other methods have no fine position and no acceleration. Numbers of more than 32 bits take "
            "8 bytes: the manifest says where they all are, and what the bits of `flags` are. "
            "[A stream for a DMA](../guides/integration.md#a-stream-for-a-dma) shows how to read them.\n",
            markdown(_HEADER, [_described(port) for port in _streamed()], left=range(4)),
            markdown(["number", "byte", "bytes", "kind"], _record(), left=[0, 3]),
            "## Of a control loop\n",
            "With `--loop` a core has these as well. Commands and outputs are synchronous to the clock.\n",
            markdown(_HEADER, [_described(port) for port in loop_ports(_LOOP)], left=range(4)),
            "\nWith `--command generator` it has these instead of the inputs of commands.\n",
            markdown(_HEADER, [_described(port) for port in _beyond(command="generator")], left=range(4)),
            "\nWith `--gains inputs` it has these as well. Then commands, too, are taken in the clock before "
            "control_tick.\n",
            markdown(_HEADER, [_described(port) for port in _beyond(gains="inputs")], left=range(4)),
        ]
    )


def _streamed() -> list[Port]:
    """Return ports that a stream adds."""
    alone = {port.name for port in _STREAM.ports} - {port.name for port in replace(_STREAM, stream=None).ports}
    return [port for port in _STREAM.ports if port.name in alone]


def _record() -> list[list[str]]:
    """Return rows of the table of what is in a record."""
    kinds = ("unsigned", "signed")
    return [[f"`{one.name}`", str(one.offset), str(one.size), kinds[one.signed]] for one in parts_of(_STREAM)]


def boards() -> str:
    """Return the page of the boards and of their pins."""
    rows = []
    for name, board in BOARDS.items():
        made = "project for the vendor's tools" if board.flow is None else "bitstream"
        rows.append([f"`{name}`", board.title, f"{board.clock_hz // 10**6} MHz", made])
    pins = {board.title.split(",")[0]: board.pins for board in BOARDS.values()}
    ports = dict.fromkeys(port for each in pins.values() for port in each)
    return "\n".join(
        [
            "# Boards and their pins\n",
            "`make docs` writes this page from `boards/fpga`. [Boards](../guides/boards.md) says how to use them.\n",
            markdown(["name", "board", "clock", "what is made"], rows, left=range(4)),
            markdown(
                ["port", *pins],
                [[f"`{port}`", *(each.get(port, "") for each in pins.values())] for port in ports],
                left=range(len(pins) + 1),
            ),
        ]
    )


def columns() -> str:
    """Return the page of the columns of a sweep's results."""
    same = [name for name, (_, about) in COLUMNS.items() if about == "as the option"]
    rows = [[f"`{name}`", kind, about] for name, (kind, about) in COLUMNS.items() if name not in same]
    rows.append([", ".join(f"`{name}`" for name in same), "", "as the options of these names"])
    return "\n".join(
        [
            "# Columns of a sweep\n",
            "`make docs` writes this page from `sim/studies/sweeping`. "
            "A row of what a [sweep](../guides/sweep.md) gives has "
            "these columns, and one of numbers for each name in braces, in rad/s, s and Hz.\n",
            markdown(["column", "kind", "what it is, unit"], rows, left=range(3)),
        ]
    )


def _beyond(**options: Any) -> list[Port]:
    """Return ports that options of a loop add, or make of others."""
    there = {port.name: port.direction for port in loop_ports(_LOOP)}
    return [port for port in loop_ports(replace(_LOOP, **options)) if there.get(port.name) != port.direction]


def _described(port: Port) -> list[str]:
    """Return a row of the table of ports."""
    kind = "strobe" if port.is_strobe else f"with `{port.held_by}`" if port.held_by else port.direction
    width = "signed" if port.signed else "1 bit" if port.width == 1 else "unsigned"
    return [f"`{port.name}`", kind, width, port.help]


def registers() -> str:
    """Return the page of the registers."""
    buses = "\n".join(f"| `{bus.name}` | {bus.help[0].upper()}{bus.help[1:]} |" for bus in BUSES.values())
    commanded = LoopMap(_LOOP.tachometer, replace(_LOOP, gains="inputs"))
    generating = LoopMap(_LOOP.tachometer, replace(_LOOP, gains="inputs", command="generator"))
    known = {one.name for one in RegisterMap(_LOOP.tachometer)}
    added = [one for one in commanded if one.name not in known]
    known |= {one.name for one in added if not one.name.startswith(("COMMAND", "LOOP"))}
    instead = [one for one in generating if one.name not in known]
    with_irq = RegisterMap(of_texts("s", SPEED | {"index": "yes", "health": "yes", "over-speed": "3000rpm"}), irq=True)
    interrupting = [one for one in with_irq if one.name.startswith("INTERRUPT")]
    alone = {one.name for one in RegisterMap(of_texts("s", {"ppr": "500"}))} - {"CONTROL", "STATUS"}
    placing = [one for one in RegisterMap(of_texts("s", PLACE)) if one.name not in alone]
    of_all, of_place, of_irq, of_loop, of_generator = (
        re.sub("^## ", "### ", tables(each), flags=re.MULTILINE)
        for each in (RegisterMap(of_texts("s", SPEED)), placing, interrupting, added, instead)
    )
    end = "\nWith `--command generator` there are these instead of the commands, and the others behind them.\n\n"
    return (
        _REGISTERS.replace("@BUSES@", buses)
        + of_all
        + _OF_PLACES
        + of_place
        + _INTERRUPT
        + of_irq
        + _OF_LOOPS
        + of_loop
        + end
        + of_generator
    )


def _cores(method: str) -> list[TachometerSpec]:
    """Return cores that have among them every port of a method."""
    everything = EVERYTHING if METHODS[method].facts.bounds else EVERYTHING | {"bounds": None}
    cores = [of_texts(method, everything), of_texts(method, PLACE)]
    cores.append(of_texts(method, {name: PLACE[name] for name in ("ppr", "index", "health")}))
    if not METHODS[method].facts.own_ticks:
        cores.append(of_texts(method, everything | EXTERNAL))
    if method == "rairan":
        timing = Timing(1_000_000, 100, 50)
        cores.append(METHODS[method](encoder=Encoder(500), timing=timing, adaptive=Fraction(1, 100)))  # type: ignore[call-arg]
    if method == "t":
        cores.append(of_texts(method, EVERYTHING | {"timer": "tick"}))
    if method == "mt":
        cores.append(of_texts(method, EVERYTHING | {"max-speed": "400rad/s"}))
    return cores


def functions() -> str:
    """Return the page of `import tachometry`, from its docstrings."""
    return _FUNCTIONS + "".join(_function(name) for name in api.__all__)


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


@click.command()
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), default=DOCS, help="Folder of the pages.")
def main(folder: Path) -> None:
    """Write the pages."""
    for page in (options, ports, registers, boards, columns, functions):
        write(folder / f"{page.__name__}.md", page())


if __name__ == "__main__":
    main()
