"""Words that other tools have for an option, and what a wrong name or a word in the wrong place may have meant."""

import re
from collections.abc import Collection, Sequence
from difflib import get_close_matches

from tachometry.spec.language.units import ANGLE, FREQUENCY, SPEED, TIME

_UNITS = {name for units in (TIME, FREQUENCY, SPEED, ANGLE) for name in units}
_NEAR = 0.7  # of a ratio of matching letters; what is less near is a guess that misleads

# By options without dashes: words that are taken for them, if the command has them.
_WORDS_OF = {
    "bus": "interface",
    "clock": "clk f freq frequency fclk",
    "cpr": "counts",
    "decoding": "edges multiplication quadrature x",
    "filter": "bounce debounce glitch",
    "for": "board plc",
    "index": "z",
    "index-reset": "reset",
    "jitter": "noise",
    "lines": "cycles slots",
    "max-speed": "max max-rpm rpm vmax",
    "max-speed speeds motion": "speed",
    "max-time": "timeout window",
    "method": "estimator algorithm",
    "motion": "acceleration trajectory",
    "name": "module top",
    "observer": "ki",
    "output": "dir export o out outdir",
    "ppr": "pulses resolution",
    "speeds": "range",
    "trace counts": "csv",
    "ratio": "gear gear-ratio gearing",
    "teeth": "missing-teeth wheel",
    "tick": "fs rate sample-time samples sampling ts",
    "unit": "units",
    "vcd": "fst wave waveform waves",
    "velocity-width": "width",
}


def meant(wrong: str, options: Collection[str]) -> list[str]:
    """Return options, with their dashes, that a wrong one may have meant; the most likely first."""
    word = wrong.lstrip("-").lower().replace("_", "-")
    named = [f"--{name}" for names, words in _WORDS_OF.items() if word in words.split() for name in names.split()]
    long = [name for name in options if name.startswith("--")]
    whole = [name for name in long if name in named or name == f"--{word}"]
    near = get_close_matches(word, [name.lstrip("-") for name in long], n=2, cutoff=_NEAR)
    return whole or [f"--{name}" for name in near]


def misplaced(message: str, words: Sequence[str], valued: Collection[str]) -> str:
    """Return what to type for a word in the wrong place; empty if none is. `valued` are options with an argument."""
    for before, name, word in zip(["", *words], words, words[1:], strict=False):
        if re.fullmatch(r"[\d.]+", name) and word in _UNITS:
            return f"A number and its unit are one word: type {name}{word}."
        if name in valued and word in valued:
            return f"Option {name!r} requires an argument, not {word}."
        if message.endswith(f"argument ({word})") and before == "--methods":
            return f"{message}: a list is {name},{word}."
        if message.endswith(f"argument ({word})") and name.startswith("--"):
            return f"{message}: it takes no value: leave {word} out."
    return ""
