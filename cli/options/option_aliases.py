"""Words that other tools have for an option, and what a wrong name may have meant."""

from collections.abc import Collection
from difflib import get_close_matches

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
    "tick": "fs period rate sample-time samples sampling ts",
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
