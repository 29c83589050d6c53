"""Configurations of every method in which every two options meet, as options of the command line."""

from __future__ import annotations

from fractions import Fraction

import click

from tachometry.cli.options.core import core_options
from tachometry.spec import TachometerSpec

_PPR = 500
_CLOCK_HZ = 48_000_000

# Options by what they decide. What is no option yet, and depends on the rest: `max_ticks`; `frac_bits` less than there
# can be, or 16 of them; `velocity_width` less than it can need; `max_speed`, about that of the motion; the longest
# `min_time`.
_SHARED: dict[str, list[str]] = {
    "tick": ["--tick 1", "--tick 2", "--tick 3", "--tick 960"],
    "max_ticks": ["2", "3", "500", "65536"],
    "unit": ["", "--unit rad/s", "--unit rev/s", "--unit rpm"],
    "frac_bits": ["most - 20", "16", "most - 0"],
    "velocity_width": ["", "needed - 0", "needed - 2"],
    "decoding": ["", "--decoding 2", "--decoding 1"],
    "index": ["", "--index", "--index --index-reset"],
    "filter": ["", "--filter 1", "--filter 5"],
    "max_speed": ["", "given"],
    "external": ["", "--external-tick"],
    "position_width": ["--position-width 8", "", "--position-width 48"],
    "age": ["", "--age"],
    "bounds": ["", "--bounds"],
    "lowpass": ["", "--lowpass 20kHz"],
}
_FEWER: dict[str, list[str]] = {
    "tick": ["--tick 1", "--tick 3", "--tick 960"],
    "max_ticks": ["2", "500"],
    "unit": ["", "--unit rpm"],
    "frac_bits": ["most - 20", "most - 0"],
    "velocity_width": ["", "needed - 2"],
    "max_speed": ["", "given"],
    "bounds": ["", "--bounds"],
}
_TIMED = _FEWER | {
    "external": ["", "--external-tick"],
    "lowpass": ["", "--lowpass 20kHz"],
    "timer": ["", "--timer tick"],
    "exact": ["", "--paper-exact"],
    "decay": ["", "--no-bound-decay"],
}
# What a method has of its own, with what of the rest has to do with it.
FACTORS: dict[str, dict[str, list[str]]] = {
    "s": _SHARED | {"cancel": ["", "--no-cancel"]},
    "m": _FEWER
    | {
        "external": ["", "--external-tick"],
        "age": ["", "--age"],
        "lowpass": ["", "--lowpass 20kHz"],
        "average": ["", "--average 2", "--average 3", "--average 8"],
    },
    "t": _TIMED,
    "mt": _TIMED | {"min_time": ["", "longest"]},
    "rairan": _FEWER
    | {
        "index": ["", "--index --index-reset"],
        "lowpass": ["", "--lowpass 20kHz"],
        "estimate": ["", "--estimate n2", "--estimate n1"],
        "exact": ["", "--paper-exact"],
        "decay": ["", "--no-bound-decay"],
        "adaptive": ["", "--adaptive 25%"],
    },
}

# What cannot be together.
APART = (
    (("tick", "--tick 1"), ("external", "--external-tick")),
    (("exact", "--paper-exact"), ("bounds", "--bounds")),
    (("exact", "--paper-exact"), ("decay", "--no-bound-decay")),
    (("exact", "--paper-exact"), ("adaptive", "--adaptive 25%")),
    (("adaptive", "--adaptive 25%"), ("max_ticks", "2")),
    (("adaptive", "--adaptive 25%"), ("lowpass", "--lowpass 20kHz")),
)


def configurations(method: str) -> list[tuple[str, ...]]:
    """Words of the command line, for each configuration of a method."""
    from covertable import make

    factors = FACTORS[method]

    def never(one: tuple[str, str], other: tuple[str, str]) -> dict[str, object]:
        equal = [{"operator": "eq", "left": factor, "value": value} for factor, value in (one, other)]
        return {"operator": "not", "condition": {"operator": "and", "conditions": equal}}

    apart = [never(one, other) for one, other in APART if one[0] in factors and other[0] in factors]
    return [_words(method, dict(row)) for row in make(factors, constraints=apart)]


def spec_of(words: tuple[str, ...]) -> TachometerSpec:
    """The core that the command line makes of these words."""

    @click.command()
    @core_options
    def collect(spec: TachometerSpec) -> TachometerSpec:
        return spec

    spec: TachometerSpec = collect.main(list(words), standalone_mode=False)
    return spec


def _words(method: str, row: dict[str, str]) -> tuple[str, ...]:
    """The options of a row, with numbers where it says what is special about them."""
    cycles = int(row["tick"].split()[1])
    decoding = int((row.get("decoding") or "--decoding 4").split()[1])
    longest = cycles * int(row.pop("max_ticks"))
    text = f"--method {method} --ppr {_PPR} --clock {_CLOCK_HZ} --max-time {longest} "
    if row.pop("min_time", ""):
        text += f"--min-time {longest} "
    if row.pop("max_speed"):
        counts = Fraction(9, 4) if cycles > 2 else Fraction(3, 4)
        text += f"--max-speed {float(counts * _CLOCK_HZ / (cycles * _PPR * decoding))}rev/s "
    frac_bits, width = row.pop("frac_bits"), row.pop("velocity_width")
    words = tuple((text + " ".join(row.values())).split())
    spec = spec_of(words)
    fewest, most = spec.frac_bits_range(spec.unit)
    bits = min(16, most) if frac_bits == "16" else max(fewest, most - _less(frac_bits))
    words += ("--frac-bits", str(bits))
    if width:
        words += ("--velocity-width", str(max(8, spec_of(words).velocity_width - _less(width))))
    return words


def _less(text: str) -> int:
    """How much less than the most: 20 of "most - 20"."""
    return int(text.split()[-1])
