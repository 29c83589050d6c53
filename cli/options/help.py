"""Help in a sentence per option: the ten that most need with -h, all with --help; `tachometry help` explains one."""

import re
from collections.abc import Sequence

import click

_WIDTH, _COLUMN = 80, 20
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
    """Return an option's names and the first sentence on it, and its default where that fits."""
    names, text = record
    text, _, default = text.partition(" [default: ")
    first = re.split(r"(?<!\beq)\. ", text)[0].strip().rstrip(".")
    start = f"  {names}  ".ljust(_COLUMN)
    if len(start) + len(first) > width:
        start = start.rstrip() + "\n" + " " * _COLUMN
    shown = f" [{default.split(']')[0].split(';')[0]}]" if default else ""
    return start + first + shown * (len(start.rpartition("\n")[2] + first + shown) <= width)
