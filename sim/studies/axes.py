"""Cores of many axes that are verified, as words of the command line."""

from tachometry.sim.studies.pairs import spec_of
from tachometry.spec import AxesSpec, CoreSpec, STachometer

Words = tuple[str, ...]


def _words(axes: int, tick: int, max_ticks: int, *more: str) -> Words:
    core = ("--ppr", "500", "--clock", "48000000", "--tick", str(tick), "--max-time", str(tick * max_ticks))
    return ("--method", "s", *core, *more, "--axes", str(axes))


# Few and many axes, all slots taken and not, turns that fill the tick, and every option that many axes have.
AXES: tuple[Words, ...] = (
    _words(8, 960, 20, "--max-speed", "1000rad/s"),
    (*_words(5, 120, 3, "--max-speed", "10000rad/s", "--index"), "--parallel"),
    _words(3, 40, 2, "--decoding", "2", "--position-width", "8"),
    _words(1, 63, 2048, "--no-cancel", "--index"),
    _words(64, 960, 5, "--max-speed", "500rad/s", "--decoding", "1", "--frac-bits", "4", "--position-width", "48"),
    (*_words(17, 1000, 4, "--frac-bits", "24", "--index"), "--parallel"),
)


def core_of(words: Words) -> CoreSpec:
    """Return the core that the command line makes of these words, which may be one of many axes."""
    if "--axes" not in words:
        return spec_of(words)
    place = words.index("--axes")
    alone = spec_of(words[:place])
    assert isinstance(alone, STachometer)
    return AxesSpec(tachometer=alone, axes=int(words[place + 1]), parallel="--parallel" in words)
