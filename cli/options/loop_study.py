"""The options of `loop` say what controller, motor, task and encoder there are."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

from tachometry.cli.options.core import core_click_options
from tachometry.cli.options.motion import DISC_OPTIONS
from tachometry.cli.options.option import Group, declared, option, plain_options, take_values
from tachometry.cli.options.sweep import by_name
from tachometry.sim.encoder.options import EncoderOptions
from tachometry.spec import TachometerSpec
from tachometry.spec.control.law import Law
from tachometry.spec.control.motor import Motor
from tachometry.spec.core.timing import whole_clocks
from tachometry.spec.language.option import ParameterError, options_of
from tachometry.spec.language.units import TIME, TORQUE, format_time, parse_time, read_nearest
from tachometry.spec.methods.track import in_loop

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.studies.loops.control import Load, Setting

_LOOP, _MOTOR = "Controller", "Motor and load"


MOST_SECONDS = 100.0

_OPTIONS = [
    *(declared(_MOTOR if about in options_of(Motor) else _LOOP, about) for about in options_of(Law)),
    *plain_options(
        _LOOP,
        {
            "--measured-acceleration": "The observer works at every control tick, with the acceleration that method "
            "track measures.",
            "--delay TIME": "From a control tick until its current is commanded, at most a control tick. [default: "
            "none]",
            "--gates": "Run the controller in gates, too: the core that generate --loop makes with these options.",
            "--unfiltered": "K_V acts on the velocity before the low-pass filter.",
            "--feed-forward": "Add the acceleration of the command.",
        },
    ),
    option(_MOTOR, "--driver-time TIME", fractional=True, default="100us", help="Time constant of the current."),
    option(_MOTOR, "--friction TORQUE", fractional=True, default="5mNm", help="Coulomb friction, Nm or mNm."),
    option(_MOTOR, "--viscous B", type=float, default=0.0, help="Viscous friction in Nm/(rad/s)."),
    option(
        _MOTOR,
        "--torque-noise TORQUE",
        fractional=True,
        default="5mNm",
        help="Standard deviation of a torque that is new every millisecond.",
    ),
    option(
        _MOTOR,
        "--load TORQUE:FROM:TIME",
        help="A torque against the shaft for a time, such as 0.2Nm:7s:500ms. RMS and greatest error, and the current, "
        "are then of the time before it.",
    ),
    option(_LOOP, "--from TIME", "start", default="0s", help="Leave out what comes before this time: the start."),
]

_LOOKS = 1000  # at the speed of a motion
Make = Callable[[TachometerSpec], "Setting"]


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


def _read(*, motion: str, **given: Any) -> dict[str, Any]:
    faults = take_values(EncoderOptions, given)
    return {
        "make": lambda spec: _setting(spec, motion, faults, **given),
        "motion": motion,
        "seed": faults.get("seed", 0),
    }


def _setting(
    spec: TachometerSpec,
    motion: str,
    faults: Mapping[str, Any],
    *,
    start: str,
    load: str | None,
    torque_noise: str,
    gates: bool,
    **given: Any,
) -> Setting:
    import numpy as np

    from tachometry.sim.encoder.motion import parse_motion
    from tachometry.sim.encoder.virtual import VirtualEncoder
    from tachometry.sim.studies.loops.control import Setting, Task, in_gates

    if not (0 <= (noise := read_nearest("torque_noise", torque_noise, TORQUE, "Nm")) < math.inf):
        raise ParameterError("torque_noise", f"must be at least 0 Nm, not {noise:g} Nm")
    task = Task(motion=parse_motion(motion), load=_load(load), noise=noise)
    fastest = max(map(abs, task.motion.speed(np.linspace(0, task.motion.duration, _LOOKS)).tolist()))
    most = 2 * math.pi * spec.timing.clock_hz / spec.encoder.counts_per_rev
    if fastest > most:
        raise ParameterError(
            "motion", f"must stay below {most:.6g} rad/s, a count per clock, and it reaches {fastest:.6g}"
        )
    begin, duration = float(parse_time("from", start)), task.motion.duration
    if not 0.01 <= duration <= MOST_SECONDS:
        raise ParameterError("motion", f"must last from 10ms to {MOST_SECONDS:g}s in a loop, not {duration:.6g}s")
    if not 0 <= begin <= duration - 0.002:
        raise ValueError(f"--from must be from 0 to 2ms before the end of --motion, not {start}")
    if task.load is not None and not begin + 0.002 <= task.load.begin < duration:
        raise ValueError(f"--load must begin 2ms or more after --from, and within --motion, not {load}")
    encoder = VirtualEncoder(spec.encoder.pulses_per_rev, **faults)
    spec, motor, gains = _core_motor_and_gains(spec, **given)
    setting = Setting(spec=spec, gains=gains, task=task, motor=motor, encoder=encoder, begin=begin)
    return in_gates(setting) if gates else setting


def _core_motor_and_gains(
    spec: TachometerSpec,
    *,
    measured_acceleration: bool,
    delay: str | None,
    unfiltered: bool,
    feed_forward: bool,
    driver_time: str,
    friction: str,
    viscous: float,
    **of_law: Any,
) -> tuple[TachometerSpec, Any, Any]:
    from tachometry.sim.engines.loop import Gains, Motor, Observer

    if measured_acceleration and "acceleration" not in spec.scale.entries:
        raise ParameterError("measured_acceleration", f"must not be given with method {spec.method}, which has none")
    law = Law(tachometer=spec, **take_values(Law, of_law, vars(spec.timing)))
    inertia, torque_constant = float(law.inertia), float(law.torque_constant)
    motor = Motor(
        inertia=inertia,
        torque_constant=torque_constant,
        driver_seconds=read_nearest("driver_time", driver_time, TIME, "s"),
        viscous=viscous,
        coulomb=read_nearest("friction", friction, TORQUE, "Nm"),
    )
    late = 0 if delay is None else whole_clocks("delay", delay, spec.timing.clock_hz)
    if not 0 <= late <= law.period:
        raise ParameterError(
            "delay", f"must be at most a control tick, {format_time(spec.times.seconds(law.period))}, not {delay}"
        )
    way = Observer.SYNCHRONISED if law.synchronised else Observer.CONVENTIONAL
    if measured_acceleration:
        way = Observer.ACCELERATION
    gains = Gains(
        position=float(law.position_gain),
        velocity=float(law.velocity_gain),
        observer=float(law.observer),
        filter=math.inf if law.filter is None else float(law.filter),
        seconds=float(spec.times.seconds(law.period)),
        way=way,
        delay=float(spec.times.seconds(late)),
        on_filtered=not unfiltered,
        feed_forward=feed_forward,
        inertia=inertia,
        torque_constant=torque_constant,
        current_limit=float(law.current_limit),
    )
    return in_loop(spec, law.velocity_gain), motor, gains


# Gives what makes a setting of a core, the motion in words, and the first seed.
LOOP = click.command("loop")(Group([*DISC_OPTIONS, *_OPTIONS], _read)(lambda make, motion, seed: (make, motion, seed)))


def loop_click_options() -> dict[str, click.Option]:
    """Return all options of a loop but those of its core, by their names."""
    return by_name(LOOP)


def loop_options() -> dict[str, click.Option]:
    """Return all options of a loop and its core that may vary, by their names."""
    return core_click_options() | loop_click_options()
