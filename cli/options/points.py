"""The points of a sweep: every method at every combination of the values of its axes."""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from itertools import product

import click

from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.loop_study import loop_options, read_loop
from tachometry.cli.options.methods import listed_methods, shown_name
from tachometry.cli.options.option import message_of
from tachometry.cli.options.sweep import point_options
from tachometry.cli.options.sweep_settings import Settings, Text
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.studies.sweeping.grid import Grid, Item, Loops, Points
from tachometry.sim.studies.sweeping.loops import LoopPoint, seeds_from
from tachometry.sim.studies.sweeping.sweep import COLUMNS, Point
from tachometry.spec import AUTO, METHODS, ParameterError, common_options, methods_with, of_texts
from tachometry.spec.language.option import options_of, read_options
from tachometry.spec.language.units import FREQUENCY, SPEED, TIME, read_nearest

Listed = tuple[str, str | None, Mapping[str, str]]  # name, method, and its options

_MOST, _MOST_LOOPS = 1_000_000, 100_000
_PLACE = re.compile(r"\{([^{}]*)\}")
_UNITS = SPEED | TIME | FREQUENCY
_FAULTS = tuple(about.name for about in options_of(EncoderOptions))


def points_of(settings: Settings, methods: str, earliest: float, engine: str | None, read_delay: float = 0.0) -> Points:
    """Return all points of a sweep; ValueError if an axis is not known, or a point cannot be.

    An option that not all methods have is for those that have it; `tick` is not for a method that has its `dt`. If
    `methods` is `all`, those that cannot be are left out. `earliest` and `read_delay` are in seconds.
    """
    listed, everything = _listed(methods)
    _check_axes(settings, {method for _, method, _ in listed if method is not None})
    own = [[name for name in settings.vary if _has_option(settings, str(method), name)] for _, method, _ in listed]
    count = sum(math.prod(len(settings.vary[name]) for name in names) for names in own)
    if count > _MOST:
        raise ValueError(f"--vary must give at most {_MOST} points, not {count}")
    maker = _Maker((earliest, engine, read_delay))
    grid = Points({}, {}, settings.axes)
    _fill(grid, settings, listed, maker.point, everything=everything)
    return grid


def _listed(methods: str) -> tuple[Sequence[Listed], bool]:
    """Return the methods of a list, and whether those that cannot be are left out: all were asked for."""
    everything = methods.strip() == "all"
    return [(name, name, {}) for name in METHODS] if everything else listed_methods(methods), everything


def _has_option(settings: Settings, method: str, name: str) -> bool:
    """Return whether an option is for a method."""
    if method == AUTO:
        return True
    own_ticks = METHODS[method].facts.own_ticks
    if name == "dt":
        return own_ticks
    if name == "tick" and own_ticks:
        return not ("dt" in settings.fixed or "dt" in settings.vary)
    has = methods_with(name)
    common = {about.name: about for about in common_options()}.get(name)
    if common is None or method in has:
        return not has or method in has
    # Where another method has an option of this name, it is for this one only with the flag that it needs.
    return not has or common.needs in settings.fixed or common.needs in settings.vary


def _check_options(settings: Settings, methods: set[str]) -> None:
    """Refuse options that are for none of the methods, with a ValueError."""
    needs = {about.name: f", or with --{about.needs}" for about in common_options() if about.needs}
    for name in (*settings.fixed, *settings.vary):
        if not any(_has_option(settings, method, name) for method in methods) and (has := methods_with(name)):
            has_it = ", ".join(has) + needs.get(name, "")
            raise ValueError(f"--{name} must be given with a method that has it: {has_it}")


def _check_axes(settings: Settings, methods: set[str]) -> None:
    motions = settings.vary.get("motion") or [settings.fixed.get("motion")]
    places = {name for motion in motions for name in _PLACE.findall(motion or "")}
    options = point_options()
    for name in settings.vary:
        if name not in options and name not in places:
            raise ValueError(
                f"--vary must be of {', '.join(options)}, or of a name in braces within --motion, such as "
                f"{{speed}}, not {name!r}"
            )
    for name in places:
        if re.fullmatch(r"[a-z]\w*", name, re.ASCII) is None or name in options or name in COLUMNS:
            raise ValueError(f"--motion must have names in braces that are no option or column, not {name!r}")
        if name not in settings.vary:
            raise ValueError(f"--vary must have values for {{{name}}} of --motion, such as --vary {name}=1,2,5")
    _check_options(settings, methods)


class _Maker:
    """Makes points; what many of them share is made once."""

    def __init__(self, run: tuple[float, str | None, float]) -> None:
        self._run, self._core, self._motion = run, tuple(core_click_options()), cache(parse_motion)
        self._spec = cache(lambda method, texts: of_texts(method, dict(texts)))
        self._values = cache(lambda texts: read_options(EncoderOptions, dict(texts)))

    def point(self, name: str, method: str, given: Mapping[str, str], texts: Mapping[str, Text]) -> Point:
        """Return the point of a method, with texts of some of its options and of names in the motion."""
        core = {key: texts[key] for key in self._core if key in texts} | dict(given)
        spec = self._spec(method, tuple(core.items()))
        faults = {key: text for key in _FAULTS if (text := texts.get(key)) is not None}
        encoder = encoder_of(spec, **self._values(tuple(faults.items())))
        if (motion := texts.get("motion")) is None:
            raise ParameterError("motion", "must be given")
        places = {key: texts[key] or "" for key in _PLACE.findall(motion)}
        values = {key: read_nearest(f"{{{key}}}", text, _UNITS, "rad/s") for key, text in places.items()}
        motion = _PLACE.sub(lambda place: places[place[1]], motion)
        moved = self._motion(motion)
        return Point(shown_name(name, spec), spec, encoder, moved, motion, values, *self._run)


def loops_of(settings: Settings, methods: str, n_seeds: int) -> Loops:
    """Return all loops, as `points_of` does; ValueError if an axis is not known, or a loop cannot be."""
    listed, everything = _listed(methods)
    options = loop_options()
    for name in settings.vary:
        if name not in options:
            raise ValueError(f"--vary must be of {', '.join(options)}, not {name!r}")
    _check_options(settings, {method for _, method, _ in listed if method is not None})
    count = len(listed) * math.prod(map(len, settings.vary.values()))
    if count > _MOST_LOOPS:
        raise ValueError(f"--vary must give at most {_MOST_LOOPS} loops, not {count}")
    grid = Loops({}, {}, settings.axes)
    _fill(grid, settings, listed, partial(_loop, n_seeds), everything=everything, alone=True)
    return grid


def _loop(n_seeds: int, name: str, method: str, given: Mapping[str, str], texts: Mapping[str, Text]) -> LoopPoint:
    core = {key: texts[key] for key in core_click_options() if key in texts} | dict(given)
    make, motion, seed = read_loop({key: text for key, text in texts.items() if text is not None})
    setting = make(of_texts(method, core, make))
    return LoopPoint(shown_name(name, setting.spec), setting, motion, seeds_from(seed, n_seeds))


def _fill(
    grid: Grid[Item],
    settings: Settings,
    listed: Sequence[Listed],
    make: Callable[[str, str, Mapping[str, str], Mapping[str, Text]], Item],
    *,
    everything: bool,
    alone: bool = False,
) -> None:
    """Add the points of all methods at all values; with `everything`, a method that cannot be is left out.

    `alone`: where there is one method and no axis, an error names neither. It raises ValueError if a point cannot be.
    """
    for name, method, given in listed:
        assert method is not None
        names = [key for key in settings.vary if _has_option(settings, method, key)]
        fixed = {key: text for key, text in settings.fixed.items() if _has_option(settings, method, key)}
        for values in product(*(settings.vary[key] for key in names)):
            at = dict(zip(names, values, strict=True))
            try:
                point = make(name, method, given, fixed | at)
            except (ValueError, click.UsageError) as error:
                message = error.format_message() if isinstance(error, click.UsageError) else message_of(error)
                where = ", ".join(f"{key}={text or 'none'}" for key, text in at.items())
                if everything or where or not alone:
                    message += f" (method {name}{', ' * bool(where)}{where})"
                if everything and name != listed[0][0]:
                    grid.left_out.setdefault(name, message)
                    continue
                raise ValueError(message) from None
            grid.points.setdefault(point.digest, point)
            grid.at.setdefault(point.digest, {key: text or "none" for key, text in at.items()})
