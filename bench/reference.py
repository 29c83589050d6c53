"""The reference pages of the documentation, docs/options.md and docs/ports.md, from what the code declares."""

from fractions import Fraction
from pathlib import Path

import click
from pages import markdown, write

from tachometry.cli.group import cli
from tachometry.cli.options.option import Option
from tachometry.spec import METHODS, Encoder, TachometerSpec, Timing, of_texts

DOCS = Path(__file__).resolve().parent.parent / "docs"
# Cores with all ports that the methods have.
EVERYTHING = {"ppr": "500", "index": "yes", "filter": "4", "age": "yes", "bounds": "yes", "velocity-width": "20"}
EXTERNAL = {"external-tick": "yes"}


def options() -> str:
    """The page of all options: a section for each group, under the first command that has it."""
    parts = [
        "# Options\n",
        "Made by `make docs` from what the code declares; `tachometry COMMAND --help` prints the same. Options of the "
        "groups Encoder, Timing, Core, Method, Motion and Encoder faults mean the same in every command.\n",
    ]
    seen: set[str] = set()
    for name, command in cli.commands.items():
        parts.append(f"## tachometry {name}\n\n{(command.short_help or '').strip()}\n")
        groups: dict[str, list[list[str]]] = {}
        with command.make_context(name, [], resilient_parsing=True) as context:
            for parameter in command.get_params(context):
                if isinstance(parameter, Option) and (record := parameter.get_help_record(context)) is not None:
                    groups.setdefault(parameter.group, []).append([_code(record[0]), _cell(record[1])])
        known = [group for group, rows in groups.items() if _key(group, rows) in seen]
        for group, rows in groups.items():
            if group not in known:
                parts.append(f"### {group}\n\n{markdown(['option', 'meaning'], rows, left=(0, 1))}\n")
                seen.add(_key(group, rows))
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
    """The page of all ports of all methods."""
    found: dict[str, list[str]] = {}
    has: dict[str, list[str]] = {}
    always = {port.name for method in METHODS for port in of_texts(method, {"ppr": "500"}).ports}
    for method in METHODS:
        for spec in _cores(method):
            for port in spec.ports:
                kind = "strobe" if port.is_strobe else f"with `{port.held_by}`" if port.held_by else port.direction
                width = "signed" if port.signed else "1 bit" if port.width == 1 else "unsigned"
                found.setdefault(port.name, [f"`{port.name}`", kind, width, port.help])
                if method not in has.setdefault(port.name, []):
                    has[port.name].append(method)
    rows = []
    for name, (code, kind, width, meaning) in found.items():
        only = "" if len(has[name]) == len(METHODS) else f" Methods: {', '.join(has[name])}."
        rows.append([code, kind, width, meaning + only + ("" if name in always else " Only with its option.")])
    return "\n".join(
        [
            "# Ports\n",
            "Made by `make docs` from `spec.ports`. A *strobe* is high for one clock; an output *with* a strobe is new "
            "in its clocks, and held until the next. Widths depend on the options: the manifest NAME.json has those "
            "of your core.\n",
            markdown(["port", "when", "kind", "meaning"], rows, left=range(4)),
            "\nThe manifest states the latencies: a level sampled at clock c is counted in the window of c + "
            "`pin_to_count`, `tick` is high `tick_latency` clocks after the window's last clock, and `velocity_valid` "
            "`tick_to_velocity` clocks after `tick`.\n",
        ]
    )


def _cores(method: str) -> list[TachometerSpec]:
    """Cores that have among them every port of a method."""
    cores = [of_texts(method, EVERYTHING)]
    if not METHODS[method].own_ticks:
        cores.append(of_texts(method, EVERYTHING | EXTERNAL))
    if method == "rairan":
        timing = Timing(1_000_000, 100, 50)
        cores.append(METHODS[method](encoder=Encoder(500), timing=timing, adaptive=Fraction(1, 100)))  # type: ignore[call-arg]
    if method == "t":
        cores.append(of_texts(method, EVERYTHING | {"timer": "tick"}))
    if method == "mt":
        cores.append(of_texts(method, EVERYTHING | {"max-speed": "400rad/s"}))
    return cores


@click.command()
@click.option("-o", "--output", "folder", type=click.Path(path_type=Path), default=DOCS, help="Folder of the pages.")
def main(folder: Path) -> None:
    """Write docs/options.md and docs/ports.md."""
    write(folder / "options.md", options())
    write(folder / "ports.md", ports())


if __name__ == "__main__":
    main()
