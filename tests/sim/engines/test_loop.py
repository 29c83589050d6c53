"""Plant and controller of the compiled loop, each against the same computed another way."""

import math
from dataclasses import replace

import numpy as np
import pytest
from loops import KINDS, MOTOR, REAL, core, setting

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.loop import Course, FloatArray, Gains, Log, LoopSimulation, Motor, Observer
from tachometry.sim.studies.loops.control import edges_of, simulation_of
from tachometry.spec.language.option import ParameterError

S_CORE = core(KINDS[0], 20e-6)
TICK = 20e-6
IDLE = Gains(position=0, velocity=0, observer=1e-9, filter=1, seconds=TICK)
PLAIN = Motor(driver_seconds=0)
IDEAL = VirtualEncoder(500)


def driven(
    current: FloatArray, motor: Motor, encoder: VirtualEncoder = IDEAL, simulation: LoopSimulation | None = None
) -> Log:
    """Return a run without control: a current (A) for each millisecond."""
    zero = np.zeros(len(current) + 1)
    course = Course(seconds=1e-3, speed=zero, angle=zero, load=zero, current=np.append(current, 0.0))
    return (simulation or simulation_of(S_CORE)).run(motor, edges_of(encoder), IDLE, course)


def test_the_current_comes_with_the_time_constant_of_the_driver() -> None:
    motor = Motor(driver_seconds=3e-4, coulomb=0.001)
    log = driven(np.repeat([2.0, -1.0], 10), motor)
    early, late = log["time"] < 0.01, log["time"] >= 0.01
    expected = np.where(early, 2 * (1 - np.exp(-log["time"] / 3e-4)), 0)
    after = log["time"] - 0.01
    expected[late] = (-1 + (1 + 2 * (1 - math.exp(-0.01 / 3e-4))) * np.exp(-after / 3e-4))[late]
    np.testing.assert_allclose(log["driven"], expected, atol=1e-9)


def test_speed_and_angle_of_a_step_of_the_current() -> None:
    log, motor = driven(np.full(50, 1.5), Motor()), Motor()
    t, tau, rate = log["time"], motor.driver_seconds, 1.5 * motor.torque_constant / motor.inertia
    gone = 1 - np.exp(-t / tau)
    np.testing.assert_allclose(log["speed"], rate * (t - tau * gone), atol=1e-9)
    angle = rate * (t**2 / 2 - tau * t + tau**2 * gone)
    np.testing.assert_allclose(log["angle"] - log["angle"][0], angle, atol=1e-6)


def test_what_the_current_gives_is_motion_or_lost_to_friction() -> None:
    motor = Motor(coulomb=0.01, viscous=4e-4)
    current = np.random.default_rng(5).uniform(-4, 6, 300)
    log = driven(current, motor)
    steps = {name: (values[1:] + values[:-1]) / 2 for name, values in log.items()}
    way = np.diff(log["angle"])
    given = np.sum(motor.torque_constant * steps["driven"] * way)
    lost = np.sum(motor.coulomb * np.abs(way) + motor.viscous * steps["speed"] * way)
    kept = motor.inertia * log["speed"][-1] ** 2 / 2
    assert lost > given / 10
    assert given == pytest.approx(kept + lost, rel=2e-3)


def holds_a_shaft_that_rests(simulation: LoopSimulation | None = None) -> None:
    """Friction of 30 mNm is half an ampere: below it nothing moves, above it the rest does, and it comes to rest."""
    motor = replace(PLAIN, coulomb=0.03015)
    log = driven(np.repeat([0.49, -0.49, 1.5, 0.0], 20), motor, simulation=simulation)
    speed = log["speed"]
    assert not speed[:401].any()
    np.testing.assert_allclose(speed[401:600], (log["time"][401:600] - 0.04) * 0.0603 / 0.003, rtol=1e-6)
    # Half of what drove it brakes: it takes twice as long.
    assert speed[700] == pytest.approx(speed[600] * 3 / 4, rel=1e-2)
    log = driven(np.repeat([1.5, 0.0], [20, 60]), motor, simulation=simulation)
    assert not log["speed"][610:].any()
    assert len(set(log["angle"][610:])) == 1


def test_friction_holds_a_shaft_that_rests() -> None:
    holds_a_shaft_that_rests()


@pytest.mark.parametrize("encoder", [IDEAL, replace(REAL, jitter=0, duty_error_deg=15), replace(REAL, jitter=0)])
def test_counts_are_those_of_the_virtual_encoder(encoder: VirtualEncoder) -> None:
    """To and fro at constant acceleration, which is a motion; but for the clocks that a count takes."""
    log = driven(np.repeat([2.0, -2.0, 2.0], [100, 300, 200]), PLAIN, encoder)
    fast = 2 * PLAIN.torque_constant / PLAIN.inertia * 0.1
    motion = parse_motion(
        f"ramp:0:{fast!r}rad/s:100ms+ramp:{fast!r}rad/s:{-2 * fast!r}rad/s:300ms+ramp:{-2 * fast!r}rad/s:0:200ms"
    )
    encoding = replace(encoder, start_angle_rad=encoder.disc.pitch_rad / 2).record(motion)
    time = log["time"][1:] - (S_CORE.latency.pin_to_count + 1) / S_CORE.timing.clock_hz
    expected = encoding.true_position(time) - encoding.true_position(0.0)
    wrong = log["position"][1:] - expected
    assert np.abs(wrong).max() <= 1
    assert np.count_nonzero(wrong) < 30  # of 6000: a clock earlier or later
    assert np.ptp(expected) > 300


def test_jitter_moves_each_passage_by_so_much_of_a_gap() -> None:
    """At constant speed, edges of a fine log: their standard deviation in pitches, and none out of order."""
    course = Course(
        seconds=1e-3,
        **dict.fromkeys(("speed", "angle", "load"), np.zeros(301)),
        current=np.append(np.repeat([8.0, 0.0], [100, 200]), 0.0),
    )
    logs = {}
    for jitter in (0.0, 0.1):
        edges = edges_of(VirtualEncoder(500, jitter=jitter))
        logs[jitter] = simulation_of(S_CORE).run(PLAIN, edges, IDLE, course, log=2e-6)
    time = {jitter: log["time"][np.flatnonzero(np.diff(log["position"]) > 0)] for jitter, log in logs.items()}
    n = min(map(len, time.values()))
    speed = logs[0.0]["speed"][-1]
    late = (time[0.1][:n] - time[0.0][:n])[-900:] * speed / IDEAL.disc.pitch_rad
    assert np.diff(logs[0.1]["position"]).min() >= 0
    assert late.std() == pytest.approx(0.1, rel=0.1)
    assert abs(late.mean()) < 0.01


def weights_of_eq_22(way: Observer, simulation: LoopSimulation | None = None) -> None:
    """All that the controller knows and does, again from the velocities and positions that it got."""
    one = setting(KINDS[0], 60.0, TICK, REAL)
    gains = replace(one.gains, way=way, current_limit=3.0)
    log = (simulation or simulation_of(S_CORE)).run(
        MOTOR, edges_of(replace(REAL, seed=3)), gains, one.task.course(MOTOR, 3), log=TICK
    )
    part = slice(int(0.4 / TICK), int(0.8 / TICK))
    names = ("time", "position", "held", "y", "z", "disturbance", "current")
    time, position, held, y, z, disturbance, current = (log[name][part].tolist() for name in names)
    to_speed = gains.torque_constant / (gains.inertia * gains.observer)
    first = (
        S_CORE.latency.pin_to_count + S_CORE.latency.tick + S_CORE.latency.tick_to_velocity + 1
    ) / S_CORE.timing.clock_hz
    conventional, last, tested = way is Observer.CONVENTIONAL, 0, 0
    for k in range(1, len(y)):
        if conventional or y[k] != y[k - 1]:
            seconds = TICK if conventional else (k - last) * TICK
            mean = current[k - 1] if conventional else sum(current[last:k]) / (k - last)
            if last:  # there was an update before
                expected = y[k - 1] + (1 - math.exp(-gains.filter * seconds)) * (held[k] - y[k - 1])
                assert y[k] == pytest.approx(expected, rel=1e-9), k
                new = 1 - math.exp(-gains.observer * seconds)
                assert z[k] == pytest.approx(z[k - 1] + new * (to_speed * mean + y[k] - z[k - 1]), rel=1e-9), k
                tested += 1
            last = k
        if tested:
            torque = gains.inertia * gains.observer * (z[k] - y[k])
            assert disturbance[k] == pytest.approx(torque, rel=1e-9, abs=1e-12)
            at = time[k - 1] + first
            angle = 39 * 0.3 / 2 + 39 * (at - 0.3)
            error = angle - position[k] * 2 * math.pi / 2000
            wanted = gains.inertia * (gains.position * error + gains.velocity * (39 - y[k])) + torque
            command = max(min(wanted / gains.torque_constant, 3.0), -3.0)
            assert abs(current[k] - command) < 0.02, k  # a count may come between the tick and the row
    assert tested > 2000


@pytest.mark.parametrize("way", [Observer.SYNCHRONISED, Observer.CONVENTIONAL])
def test_weights_of_eq_22(way: Observer) -> None:
    weights_of_eq_22(way)


def test_with_an_update_in_every_tick_both_observers_are_the_same() -> None:
    """Method M has one."""
    kind = KINDS[0]._replace(method="m")
    one = setting(kind, 30.0, 1e-3, REAL, decoding=1)
    simulation = simulation_of(one.spec)
    ways = (Observer.SYNCHRONISED, Observer.CONVENTIONAL)
    logs = [replace(one, gains=replace(one.gains, way=way)).run(simulation, 1) for way in ways]
    assert np.abs(logs[0]["y"]).max() > 38
    for name in ("y", "z", "current", "speed"):
        np.testing.assert_allclose(logs[0][name], logs[1][name], atol=1e-9)


def test_a_current_comes_by_the_delay_later() -> None:
    one = setting(KINDS[0], 40.0, TICK, IDEAL)
    speed = np.full(6, 10.0)
    course = Course(seconds=1e-3, speed=speed, angle=speed * 1e-3, load=0 * speed, current=0 * speed)
    logs = []
    for delay in (0.0, TICK / 2, TICK):
        gains = replace(one.gains, delay=delay)
        logs.append(simulation_of(S_CORE).run(PLAIN, edges_of(IDEAL), gains, course, log=2e-6))
    begun = [int(np.flatnonzero(log["driven"])[0]) for log in logs]
    assert [later - begun[0] for later in begun] == [0, 5, 10]


def test_a_run_can_be_stopped() -> None:
    simulation = LoopSimulation(S_CORE)
    simulation.stop()
    one = setting(KINDS[0], 40.0, TICK, IDEAL)
    assert len(one.run(simulation, 0)["time"]) == 0
    simulation.stop(False)
    assert len(one.run(simulation, 0)["time"]) == 12000


@pytest.mark.parametrize(
    "motor", [Motor(inertia=1e-12), Motor(viscous=1e20), Motor(torque_constant=1e300), Motor(torque_constant=1e308)]
)
def test_a_shaft_that_runs_away_ends_the_run(motor: Motor) -> None:
    with pytest.raises(ValueError, match=r"^the shaft ran away [0-9.e-]+ s after the start, by more than two edges"):
        driven(np.full(20, 100.0), motor)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"velocity": -1.0}, "kv must be at least 0, not -1"),
        ({"observer": math.inf}, "observer must be more than 0, not inf"),
        ({"filter": 0.0}, "velocity_filter must be more than 0, not 0"),
        ({"delay": 1.0}, "delay must be at most a control tick, 2e-05 s, not 1"),
        ({"current_limit": math.nan}, "current_limit must be more than 0, not nan"),
    ],
)
def test_gains_that_cannot_be_are_refused(wrong: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        replace(IDLE, **wrong)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="inertia must be more than 0"):
        Motor(inertia=0)
