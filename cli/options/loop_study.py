"""The options of `loop`: controller, motor, task and encoder."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.motion import DISC_OPTIONS, shown_in_unit_of
from tachometry.cli.options.option import declared
from tachometry.cli.options.sweep import made_by_name
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.spec import TachometerSpec
from tachometry.spec.control.law import Law
from tachometry.spec.control.motor import Motor
from tachometry.spec.core.timing import whole_clocks
from tachometry.spec.language.option import ParameterError, options_of, read_options
from tachometry.spec.language.option import option as declaration
from tachometry.spec.language.units import PLAIN, TIME, TORQUE, Unit, format_time, parse_time, read_nearest
from tachometry.spec.methods.track import in_loop

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.engines.loop import Gains
    from tachometry.sim.studies.loops.control import Load, Setting, Task

_CONTROLLER, _MOTOR = "Controller", "Motor and load"

MOST_SECONDS = 100.0
_LOOKS = 1000  # at the speed of a motion

Make = Callable[[TachometerSpec], "Setting"]


def _of_motor(help: str, text: str, metavar: str, units: Mapping[str, Unit], plain: str) -> Any:
    def parse(what: str, text: str) -> float:
        return read_nearest(what, text, units, plain)

    return declaration(None, help, text=text, metavar=metavar, group=_MOTOR, parse=parse)


@dataclass(frozen=True, kw_only=True)
class Loop:
    """Options of a simulated loop in addition to core, law and disc; times that messages quote are texts."""

    _group = _CONTROLLER

    measured_acceleration: bool = declaration(
        False, "Let the observer use the acceleration of method track. It then works at every control tick."
    )
    delay: str | None = declaration(
        None, "Delay from a control tick to its current. At most a control tick.", metavar="TIME", shown="none"
    )
    gates: bool = declaration(
        False, "Also run the controller in gates. It is the core that generate --loop makes with these options."
    )
    unfiltered: bool = declaration(False, "K_V acts on the velocity before the low-pass filter.")
    feed_forward: bool = declaration(False, "Add the acceleration of the command.")
    driver_time: float = _of_motor("Time constant of the current.", "100us", "TIME", TIME, "s")
    friction: float = _of_motor("Coulomb friction, Nm or mNm.", "5mNm", "TORQUE", TORQUE, "Nm")
    viscous: float = _of_motor("Viscous friction in Nm/(rad/s).", "0.0", "B", PLAIN, "")
    torque_noise: float = _of_motor(
        "Standard deviation of a torque that is new every millisecond.", "5mNm", "TORQUE", TORQUE, "Nm"
    )
    load: str | None = declaration(
        None,
        "Load torque for a time, such as 0.2Nm:7s:500ms. RMS and greatest error, and the current, are "
        "those of the time before it.",
        metavar="TORQUE:FROM:TIME",
        group=_MOTOR,
    )
    start: str = declaration(
        None, "Leave out what comes before this time: the start.", text="0s", name="from", metavar="TIME"
    )


OPTIONS = [
    *DISC_OPTIONS,
    *(declared(_MOTOR if about in options_of(Motor) else _CONTROLLER, about) for about in options_of(Law)),
    *(declared(about.group, about) for about in options_of(Loop)),
]


def loop_options() -> dict[str, click.Option]:
    """Return all options of a loop and its core that may vary, by their names."""
    return core_click_options() | made_by_name(OPTIONS)


def read_loop(texts: Mapping[str, str]) -> tuple[Make, str, int]:
    """Return what makes a setting of a core, the motion as a text, and the first seed."""
    if (motion := texts.get("motion")) is None:
        raise ParameterError("motion", "must be given")
    faults, loop = read_options(EncoderOptions, texts), Loop(**read_options(Loop, texts))
    return lambda spec: _setting(spec, motion, faults, loop, texts), motion, faults.get("seed", 0)


def _load(text: str | None) -> Load | None:
    from tachometry.sim.studies.loops.control import Load

    if text is None:
        return None
    parts = text.split(":")
    if len(parts) != 3:
        raise ValueError(f"--load must be TORQUE:FROM:TIME, such as 0.2Nm:7s:500ms, not {text!r}")
    torque = read_nearest("torque of --load", parts[0], TORQUE, "Nm")
    begin, seconds = (float(parse_time("time of --load", part)) for part in parts[1:])
    return Load(torque=torque, begin=begin, seconds=seconds)


def _task(spec: TachometerSpec, motion: str, loop: Loop) -> Task:
    """Return the motion, the load and the noise; ParameterError if the motion is too fast."""
    import numpy as np

    from tachometry.sim.encoder.motion import parse_motion
    from tachometry.sim.studies.loops.control import Task

    if not 0 <= loop.torque_noise < math.inf:
        raise ParameterError("torque_noise", f"must be at least 0 Nm, not {loop.torque_noise:g} Nm")
    task = Task(motion=parse_motion(motion), load=_load(loop.load), noise=loop.torque_noise)
    fastest = max(map(abs, task.motion.speed(np.linspace(0, task.motion.duration, _LOOKS)).tolist()))
    most = 2 * math.pi * spec.timing.clock_hz / spec.encoder.counts_per_rev
    if fastest > most:
        raise ParameterError(
            "motion", f"must stay below {most:.6g} rad/s, a count per clock, and it reaches {fastest:.6g}"
        )
    return task


def _setting(
    spec: TachometerSpec, motion: str, faults: Mapping[str, Any], loop: Loop, texts: Mapping[str, str]
) -> Setting:
    from tachometry.sim.encoder.virtual import VirtualEncoder
    from tachometry.sim.engines import loop as engine
    from tachometry.sim.studies.loops.control import Setting, in_gates

    if spec.encoder.sampled is not None:
        raise ParameterError("sensor", f"must not be {spec.encoder.sensor} for a loop, which is for edges")
    spec, task = shown_in_unit_of(motion, spec), _task(spec, motion, loop)
    begin, duration = float(parse_time("from", loop.start)), task.motion.duration
    if not 0.01 <= duration <= MOST_SECONDS:
        raise ParameterError("motion", f"must last from 10ms to {MOST_SECONDS:g}s in a loop, not {duration:.6g}s")
    if not 0 <= begin <= duration - 0.002:
        raise ValueError(f"--from must be from 0 to 2ms before the end of --motion, not {loop.start}")
    if task.load is not None and not begin + 0.002 <= task.load.begin < duration:
        raise ValueError(f"--load must begin 2ms or more after --from, and within --motion, not {loop.load}")
    encoder = VirtualEncoder(spec.encoder.pulses_per_rev, ratio=spec.encoder.ratio, **faults)
    if loop.measured_acceleration and "acceleration" not in spec.method_entries:
        raise ParameterError("measured_acceleration", f"must not be given with method {spec.method}, which has none")
    law = Law(tachometer=spec, **read_options(Law, texts, vars(spec.timing)))
    motor = engine.Motor(
        inertia=float(law.inertia),
        torque_constant=float(law.torque_constant),
        driver_seconds=loop.driver_time,
        viscous=loop.viscous,
        coulomb=loop.friction,
    )
    setting = Setting(
        spec=in_loop(spec, law.velocity_gain),
        gains=_gains(law, loop),
        task=task,
        motor=motor,
        encoder=encoder,
        begin=begin,
    )
    return in_gates(setting) if loop.gates else setting


def _gains(law: Law, loop: Loop) -> Gains:
    from tachometry.sim.engines.loop import Gains, Observer

    spec, delay = law.tachometer, loop.delay
    late = 0 if delay is None else whole_clocks("delay", delay, spec.timing.clock_hz)
    if not 0 <= late <= law.period:
        raise ParameterError(
            "delay", f"must be at most a control tick, {format_time(spec.tick.seconds(law.period))}, not {delay}"
        )
    way = Observer.SYNCHRONISED if law.synchronised else Observer.CONVENTIONAL
    return Gains(
        position=float(law.position_gain),
        velocity=float(law.velocity_gain),
        observer=float(law.observer),
        filter=math.inf if law.filter is None else float(law.filter),
        seconds=float(spec.tick.seconds(law.period)),
        way=Observer.ACCELERATION if loop.measured_acceleration else way,
        delay=float(spec.tick.seconds(late)),
        on_filtered=not loop.unfiltered,
        feed_forward=loop.feed_forward,
        inertia=float(law.inertia),
        torque_constant=float(law.torque_constant),
        current_limit=float(law.current_limit),
    )
