"""The points of `tachometry loop`: every method at every combination of the values of its axes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product

import click

from tachometry.cli.options.closed_loop import LOOP, loop_click_options, loop_options
from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.methods import listed_methods
from tachometry.cli.options.option import told
from tachometry.cli.sweeping.points import has_option
from tachometry.cli.sweeping.settings import Settings, Text, arguments
from tachometry.sim.studies.loops import LoopPoint, seeds_from
from tachometry.spec import METHODS, methods_with, of_texts

_MOST = 100_000  # points


@dataclass(frozen=True)
class Loops:
    """Loops that are to be run.

    Parameters
    ----------
    points : dict of str to LoopPoint
        By their digests, in order.
    at : dict of str to dict
        Where each is: values of the axes that its method has.
    axes : dict of str to list of str
        All values of each axis.
    left_out : dict of str to str
        Methods of `all` that are impossible somewhere, and why.
    """

    points: dict[str, LoopPoint]
    at: dict[str, dict[str, str]]
    axes: dict[str, list[str]]
    left_out: dict[str, str] = field(default_factory=dict)


def loops_of(settings: Settings, methods: str, n_seeds: int) -> Loops:
    """All loops.

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
    for name in (*settings.fixed, *settings.vary):
        if (has := methods_with(name)) and not {method for _, method, _ in listed} & set(has):
            raise ValueError(f"--{name} must be given with a method that has it: {', '.join(has)}")
    count = len(listed) * math.prod(map(len, settings.vary.values()))
    if count > _MOST:
        raise ValueError(f"--vary must give at most {_MOST} loops, not {count}")
    found = Loops({}, {}, {name: [text or "none" for text in values] for name, values in settings.vary.items()})
    for name, method, given in listed:
        assert method is not None
        names = [key for key in settings.vary if has_option(settings, method, key)]
        fixed = {key: text for key, text in settings.fixed.items() if has_option(settings, method, key)}
        for values in product(*(settings.vary[key] for key in names)):
            at = dict(zip(names, values, strict=True))
            try:
                point = _point(name, method, given, fixed | at, n_seeds)
            except (ValueError, click.UsageError) as error:
                message = error.format_message() if isinstance(error, click.UsageError) else told(error)
                where = ", ".join(f"{key}={text or 'none'}" for key, text in at.items())
                if everything or where:
                    message += f" (method {name}{', ' * bool(where)}{where})"
                if everything and name != listed[0][0]:
                    found.left_out.setdefault(name, message)
                    continue
                raise ValueError(message) from None
            found.points.setdefault(point.digest, point)
            found.at.setdefault(point.digest, {key: text or "none" for key, text in at.items()})
    return found


def _point(name: str, method: str, given: Mapping[str, str], texts: Mapping[str, Text], n_seeds: int) -> LoopPoint:
    core = {key: texts[key] for key in core_click_options() if key in texts} | dict(given)
    of_loop = {key: text for key, text in texts.items() if key in loop_click_options()}
    with LOOP.make_context("loop", arguments(of_loop, loop_click_options())) as context:
        make, motion, seed = LOOP.invoke(context)
    setting = make(of_texts(method, core))
    return LoopPoint(name, setting, motion, seeds_from(seed, n_seeds))
