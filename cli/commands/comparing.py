"""`compare` runs methods as they are given, or all settings of a method to find the best one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from tachometry.cli.options.core import Make
from tachometry.cli.options.methods import Methods
from tachometry.cli.reports.terminal import progress_bar
from tachometry.sim.encoder.motion import FloatArray, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.sim.studies.comparing.compare import Curve, TrueSpeed, common_instants, core_curve
from tachometry.sim.studies.comparing.rivals import baseline_curve, settings
from tachometry.sim.studies.comparing.tune import SETTLED_S, TUNED, Cost, best, core_settings, cost, possible, triangle
from tachometry.spec import Encoder, TachometerSpec


@dataclass(frozen=True)
class Setting:
    """A method with its options.

    Parameters
    ----------
    name : str
    spec : TachometerSpec or None
        None: it is a baseline.
    encoder : Encoder
    """

    name: str
    spec: TachometerSpec | None
    encoder: Encoder

    def curve(self, recording: Recording) -> Curve:
        """Return what it shows.

        Raises
        ------
        ValueError
            If its options are wrong, or do not fit the recording.
        """
        if self.spec is None:
            return baseline_curve(self.name, recording, self.encoder.counts_per_rev, self.encoder.decoding)
        return core_curve(self.name, self.spec, PinTrace.of(recording, self.spec))


def given(named: Methods, encoder: Encoder) -> list[Setting]:
    """Return the methods as they are given."""
    return [Setting(name, spec, encoder) for name, spec in named.specs.items()]


def _tried(setting: Setting, make: Make, *, of_cores: bool) -> list[Setting]:
    """Return all settings of a method; one if it is given with options, and of a core that is not to be tuned."""
    if ":" in setting.name:
        return [setting]
    if setting.spec is None:
        return [replace(setting, name=name) for name in settings(setting.name)]
    found = [setting]
    if of_cores or setting.name in TUNED:
        for name, options in core_settings(setting.name):
            try:
                found.append(replace(setting, name=name, spec=make(setting.name, options)))
            except ValueError:
                continue  # not with this clock or tick
    return found


def _counted(settings: dict[str, list[Setting]], verb: str) -> Iterator[tuple[str, Iterator[Setting]]]:
    """Yield methods with their settings one by one; a progress bar counts these."""
    n_done, total = 0, sum(len(tried) for tried in settings.values())
    with progress_bar(verb, total, "settings") as report:

        def count(tried: list[Setting]) -> Iterator[Setting]:
            nonlocal n_done
            for setting in tried:
                yield setting
                n_done += 1
                report(n_done)

        for name, tried in settings.items():
            yield name, count(tried)


def tuned(
    named: Methods, encoder: Encoder, make: Make, recording: Recording, instants: FloatArray, true_speed: TrueSpeed
) -> tuple[Methods, dict[str, int]]:
    """Return the methods, in place of each baseline and of M/T without options its best setting.

    Returns them, and the number of settings that were tried, by the name of the best.

    Raises
    ------
    ValueError
        If a method has no setting that can be.
    """
    specs: dict[str, TachometerSpec | None] = {}
    n_tried = {}
    settings = {setting.name: _tried(setting, make, of_cores=False) for setting in given(named, encoder)}
    for name, tried in _counted(settings, "tuning"):
        if len(settings[name]) == 1:
            specs[name] = named.specs[name]
            next(tried)
            continue
        curves = possible(partial(setting.curve, recording) for setting in tried)
        found = best(curves, instants, true_speed).name
        specs[found] = next(setting.spec for setting in settings[name] if setting.name == found)
        n_tried[found] = len(settings[name])
    return replace(named, specs=specs), n_tried


def costs(
    named: Methods, encoder: Encoder, make: Make, recording: Recording, instants: FloatArray, true_speed: TrueSpeed
) -> tuple[dict[str, list[Cost]], float]:
    """Return what all settings of each method cost, and the RMS speed (rad/s) of the motion, with which delays were
    measured.

    Raises
    ------
    ValueError
        If the shaft does not move.
    """
    speed = float(np.sqrt(np.mean(true_speed(instants) ** 2)))
    if not speed:
        raise ValueError("--motion must move the shaft where there is a --tradeoff")
    found: dict[str, list[Cost]] = {}
    settings = {setting.name: _tried(setting, make, of_cores=True) for setting in given(named, encoder)}
    index = any(spec is not None and spec.index for spec in named.specs.values())
    moving = VirtualEncoder(encoder.pulses_per_rev, index=index).record(parse_motion(triangle(speed)))
    after = common_instants([], moving.recording.duration, float(instants[1] - instants[0]), SETTLED_S)
    for name, tried in _counted(settings, "measuring"):
        found[name] = []
        for setting in tried:
            try:
                curves = setting.curve(recording), setting.curve(moving.recording)
            except ValueError:
                continue  # not with this clock, encoder or motion
            measured = cost(name, *curves, (instants, true_speed), (after, moving.true_speed))
            if measured is not None:
                found[name].append(measured)
    return found, speed
