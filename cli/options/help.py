"""Help in a line per option: the ten that most need with -h, all with --help; `tachometry help` explains one."""

import re
from collections.abc import Sequence

import click

_WIDTH, _COLUMN = 80, 28
_MOST = 10
# What most need, the first first.
_NEEDED = (
    *("ppr", "lines", "clock", "tick", "pwm", "max-speed", "output", "method", "methods", "vary", "bus"),
    *("unit", "motion", "plot", "set", "selftest", "loop", "axes", "results", "engines", "only", "flash", "verilog"),
    *("csv", "a", "b", "kv", "trace", "jitter"),
)


def needed(options: Sequence[click.Option]) -> list[click.Option]:
    """Return the ten options that most need, those that must be given among them."""
    rank = {f"--{name}": place for place, name in enumerate(_NEEDED)}
    shown = [option for option in options if not option.hidden and option.name != "help"]
    best = sorted(shown, key=lambda option: (not option.required, min(rank.get(name, 99) for name in option.opts)))
    return best[:_MOST]


def line(record: tuple[str, str], width: int = _WIDTH) -> str:
    """Return a line on an option: its names, the first sentence on it as far as it fits, and its default if short."""
    names, text = record
    start = f"  {names}".ljust(_COLUMN - 1) + " "
    sentence, default = text, ""
    if " [default: " in text:
        sentence, _, default = text.rpartition(" [default: ")
        default = f" [{default.split(']')[0].split(';')[0]}]"
    room = width - len(start)
    if len(default) > room // 2:
        default = ""
    first = re.split(r"(?<!\beq)\. ", sentence)[0].rstrip(".")
    first = first if len(first) + len(default) <= room else _cut(first, room - len(default))
    return (start + first + default)[:width].rstrip()


def _cut(text: str, room: int) -> str:
    """Return as much of a sentence as fits: to a comma or colon beyond its half, else with an ellipsis."""
    part = text[: max(room, 1)]
    for mark in (";", ":", ",", " ("):
        place = part.rfind(mark)
        if place > room // 2:
            return part[:place]
    return part[: max(room - 1, 0)].rsplit(" ", 1)[0].rstrip(",:;") + "…"
