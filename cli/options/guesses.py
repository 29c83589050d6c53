"""Words that other tools have for an option, and what a wrong name may have meant."""

from collections.abc import Collection
from difflib import get_close_matches

_NEAR = 0.7  # of a ratio of matching letters; what is less near is a guess that misleads

# By words without dashes; of the options behind one, those that the command has are told.
_OTHER_WORDS = {
    "acceleration": "motion",
    "board": "for",
    "bounce": "filter",
    "clk": "clock",
    "counts": "cpr",
    "cycles": "lines",
    "debounce": "filter",
    "dir": "output",
    "edges": "decoding",
    "estimator": "method",
    "export": "output",
    "f": "clock",
    "freq": "clock",
    "frequency": "clock",
    "fclk": "clock",
    "fs": "tick",
    "glitch": "filter",
    "interface": "bus",
    "ki": "observer",
    "max": "max-speed",
    "module": "name",
    "multiplication": "decoding",
    "noise": "jitter",
    "o": "output",
    "out": "output",
    "outdir": "output",
    "algorithm": "method",
    "period": "tick",
    "plc": "for",
    "pulses": "ppr",
    "quadrature": "decoding",
    "range": "speeds",
    "rate": "tick",
    "reset": "index-reset",
    "resolution": "ppr",
    "rpm": "max-speed",
    "sample-time": "tick",
    "samples": "tick",
    "sampling": "tick",
    "slots": "lines",
    "speed": "max-speed speeds motion",
    "teeth": "lines",
    "timeout": "max-time",
    "top": "name",
    "trajectory": "motion",
    "ts": "tick",
    "units": "unit",
    "vmax": "max-speed",
    "width": "velocity-width",
    "window": "max-time",
    "x": "decoding",
    "z": "index",
}


def meant(wrong: str, options: Collection[str]) -> list[str]:
    """Return options, with their dashes, that a wrong one may have meant; the most likely first."""
    word = wrong.lstrip("-").lower().replace("_", "-")
    named = [f"--{name}" for name in _OTHER_WORDS.get(word, "").split()]
    long = [name for name in options if name.startswith("--")]
    whole = [name for name in long if name in named or name == f"--{word}"]
    near = get_close_matches(word, [name.lstrip("-") for name in long], n=2, cutoff=_NEAR)
    return whole or [f"--{name}" for name in near]
