"""The points of `tachometry loop`: every method at every combination of the values of its axes."""

import math
from collections.abc import Mapping

from tachometry.cli.options.closed_loop import LOOP, loop_click_options, loop_options
from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.methods import listed_methods
from tachometry.cli.sweeping.points import Found, check_options
from tachometry.cli.sweeping.settings import Settings, Text, arguments
from tachometry.sim.studies.sweeping.loops import LoopPoint, seeds_from
from tachometry.spec import METHODS, of_texts

_MOST = 100_000  # points


Loops = Found[LoopPoint]


def loops_of(settings: Settings, methods: str, n_seeds: int) -> Loops:
    """Return all loops.

    Parameters
    ----------
    settings : Settings
        Options of core and loop, and axes.
    methods : str
        See `listed_methods`, or `all`: then those that cannot be are left out.
    n_seeds : int

    Raises
    ------
    ValueError
        If an axis is not known, or a loop cannot be.
    """
    everything = methods.strip() == "all"
    listed = [(name, name, {}) for name in METHODS] if everything else listed_methods(methods)
    options = loop_options()
    for name in settings.vary:
        if name not in options:
            raise ValueError(f"--vary must be of {', '.join(options)}, not {name!r}")
    check_options(settings, {method for _, method, _ in listed if method is not None})
    count = len(listed) * math.prod(map(len, settings.vary.values()))
    if count > _MOST:
        raise ValueError(f"--vary must give at most {_MOST} loops, not {count}")
    found = Loops({}, {}, {name: [text or "none" for text in values] for name, values in settings.vary.items()})
    found.fill(
        settings,
        listed,
        lambda name, method, given, texts: _point(name, method, given, texts, n_seeds),
        everything=everything,
        alone=True,
    )
    return found


def _point(name: str, method: str, given: Mapping[str, str], texts: Mapping[str, Text], n_seeds: int) -> LoopPoint:
    core = {key: texts[key] for key in core_click_options() if key in texts} | dict(given)
    of_loop = {key: text for key, text in texts.items() if key in loop_click_options()}
    with LOOP.make_context("loop", arguments(of_loop, loop_click_options())) as context:
        make, motion, seed = LOOP.invoke(context)
    setting = make(of_texts(method, core))
    return LoopPoint(name, setting, motion, seeds_from(seed, n_seeds))
