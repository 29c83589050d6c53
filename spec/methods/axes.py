"""Many axes through one datapath: each is looked at in turn, and keeps its state in memory."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

from tachometry.spec.core.extras.extra import refuse
from tachometry.spec.core.latency import TICK_IN_TO_WINDOW_END
from tachometry.spec.core.tachometer import TachometerSpec, WithTachometer
from tachometry.spec.core.tick import Tick
from tachometry.spec.core.timing import Timing
from tachometry.spec.core.words import Words
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import INDEX, TICK, UPDATE, Port, Ports, held, pin, strobe
from tachometry.spec.language.units import next_written_time, written_time
from tachometry.spec.methods.axis import COUNT_LATENCY, FILTER_LATENCY, MAX_AXES, MIN_SLOTS, WARM_UP, Plan, slots_of
from tachometry.spec.methods.s import STachometer
from tachometry.spec.methods.s_axis import SAxis
from tachometry.spec.methods.track import TrackTachometer
from tachometry.spec.methods.track_axis import TrackAxis

_FOR_ONE = "is for one axis"
# Options of the core of one axis, the value that leaves them out, and why many axes do not have them.
_LEFT_OUT: tuple[tuple[str, Any, str], ...] = (
    ("age", False, f"what counts the ticks {_FOR_ONE}"),
    ("bounds", False, f"what finds them {_FOR_ONE}"),
    ("preset", None, f"what sets the position {_FOR_ONE}"),
    ("position_modulo", None, f"its counter {_FOR_ONE}"),
    ("blanking_clocks", 0, f"its timer {_FOR_ONE}"),
    ("lowpass", None, f"the filter {_FOR_ONE}"),
)
_STROBES = {
    UPDATE: "One clock for every update of the velocity of an axis, together with its tick.",
    TICK: "One clock for every axis and every sampling period, axis 0 first.",
    "decode_error": "One clock: both lines of an axis changed at once, so the direction is unknown and nothing was "
    "counted.",
    INDEX: "One clock for every index of an axis.",
    "tick_error": "One clock: an external tick was missing, and the core made one, or it came too early and was left "
    "out.",
}
_NEAR = 2000  # clocks; 64 axes with the S method need some 800


def one_axis(spec: STachometer | TrackTachometer, axes: int, slots: int) -> SAxis | TrackAxis:
    """Return the core that each axis is if a round has so many slots."""
    return TrackAxis.of(spec, axes, slots) if isinstance(spec, TrackTachometer) else SAxis.of(spec, axes, slots)


def _axis_at(spec: STachometer | TrackTachometer, axes: int, cycles: int) -> SAxis | TrackAxis | None:
    """Return the core that each axis is in a tick of so many clocks.

    None if that has no whole rounds, or no room for the turns of all axes.
    """
    slots = slots_of(axes, cycles)
    if slots is None:
        return None
    most = spec.timing.max_ticks * spec.timing.tick_cycles // cycles
    axis = one_axis(replace(spec, timing=Timing(spec.timing.clock_hz, cycles, max(most, 2))), axes, slots)
    return axis if axis.plan.end + slots <= cycles else None


def _possible(spec: STachometer | TrackTachometer, axes: int, cycles: int) -> SAxis | TrackAxis | None:
    try:
        return _axis_at(spec, axes, cycles)
    except ParameterError:  # no axis can have this tick
        return None


def nearest_ticks(spec: STachometer | TrackTachometer, axes: int) -> list[int]:
    """Return the longest tick below that of `spec` that fits, and the shortest above, in clocks, if they are near."""
    cycles = spec.timing.tick_cycles
    ways = (range(cycles - 1, max(cycles - _NEAR, 0), -1), range(cycles + 1, cycles + _NEAR))
    found = (next((one for one in way if _possible(spec, axes, one)), None) for way in ways)
    return [one for one in found if one is not None]


@dataclass(frozen=True)
class AxesLatency:
    """Clocks from a pin of an axis to what is shown of it."""

    # Most clocks from the sampling of a level to its look: the synchroniser, a round, and more for the filter.
    pin_to_count: int
    tick: int  # clocks from the last one of a tick to the one in which it is shown of the last axis
    # Most clocks from the rise of an external tick to the end of its window: the next round is the last.
    tick_in_to_window_end: int
    index: int  # clocks from the look that sees an index to `index_valid`
    tick_to_velocity: int = 0  # clocks from `tick` to `velocity_valid`: they come together
    tick_to_result: int = 0  # clocks from `tick` to what the core is for: to the velocity


@dataclass(frozen=True)
class AxesRecovery:
    """Recovery of a core of many axes from an upset, see `Recovery`."""

    clocks: int | None  # after which all is right; None: the method forgets only gradually


@dataclass(frozen=True, kw_only=True)
class AxesSpec(WithTachometer):
    """Several encoders whose axes have one datapath in turn, or as many as it takes.

    In a round each axis is looked at once, in its slot of one clock. So an axis is, to the bit, a core of its own whose
    clock is a round: see `axis`.

    - `tachometer`: What each axis would be as a core of its own; its clock and tick are those of this core.
    - `parallel`: Every output has a port for each axis, which holds it.

    It raises ParameterError if there cannot be such a core.
    """

    tachometer: STachometer | TrackTachometer
    axes: int
    parallel: bool = False

    kind: ClassVar[Literal["axes"]] = "axes"

    def __post_init__(self) -> None:
        if not 1 <= self.axes <= MAX_AXES:
            raise ParameterError("axes", f"must be from 1 to {MAX_AXES}, not {self.axes}")
        spec = self.tachometer
        for name, value, why in _LEFT_OUT:
            if getattr(spec, name) != value:
                raise ParameterError(name, f"must be left out with --axes: {why}")
        refuse(spec.extras, "axes")
        if spec.extras:
            spec = replace(spec, extras=tuple(extra.in_turn(1) for extra in spec.extras))
            object.__setattr__(self, "tachometer", spec)
        if spec.front_end.index_once:
            raise ParameterError("index_once", f"must be left out with --axes: what waits for home {_FOR_ONE}")
        if spec.encoder.sensor != "quadrature":
            why = f"the decoder of {spec.encoder.sensor} {_FOR_ONE}"
            raise ParameterError("sensor", f"must be left out with --axes: {why}")
        self._check_tick()

    def _check_tick(self) -> None:
        cycles = self.timing.tick_cycles
        try:
            if _axis_at(self.tachometer, self.axes, cycles) is not None:
                return
        except ParameterError as error:
            if error.parameter != "tick":  # what that says is of one axis
                raise
        fewest = max(self.axes, MIN_SLOTS)
        some = f"a number from {fewest} to {MAX_AXES}" if fewest < MAX_AXES else f"{MAX_AXES}"
        written = [written_time(one, self.timing.clock_hz) for one in nearest_ticks(self.tachometer, self.axes)]
        near = f"--tick {' or '.join(written)}" if written else "a longer --tick"
        if isinstance(self.tachometer, TrackTachometer) and self.tachometer.multiplier == "serial":
            near += " or --multiplier block"
        raise ParameterError(
            "tick_cycles",
            f"must be a multiple of {some}, and long enough for a turn of every axis with --axes {self.axes}, "
            f"not {cycles}: try {near}",
            f"needs {near}",
        )

    @property
    def tick(self) -> Tick:
        """The sampling period, as that of the core that each axis would be."""
        return self.tachometer.tick

    @cached_property
    def slots(self) -> int:
        """S, clocks of a round: the least number that is no less than N and divides a tick."""
        found = slots_of(self.axes, self.timing.tick_cycles)
        assert found is not None  # see `_check_tick`
        return found

    @cached_property
    def axis(self) -> SAxis | TrackAxis:
        """The core that each axis is: one of its clocks is a round of this core."""
        return one_axis(self.tachometer, self.axes, self.slots)

    @property
    def rounds(self) -> int:
        """Rounds of a tick: an axis can count as many."""
        return self.axis.timing.tick_cycles

    @property
    def plan(self) -> Plan:
        """When each axis has its turn."""
        return self.axis.plan

    @property
    def count_latency(self) -> int:
        """Clocks from the look at an axis to its count."""
        return COUNT_LATENCY + FILTER_LATENCY * (self.axis.filter_clocks > 0)

    @cached_property
    def latency(self) -> AxesLatency:
        """Clocks from a pin of an axis to what is shown of it."""
        return AxesLatency(
            pin_to_count=WARM_UP - 1 + self.slots - 1 + self.axis.filter_clocks * self.slots,
            tick=int(self.tick_clock(self.axes - 1, 0)) - (self.timing.tick_cycles - 1),
            tick_in_to_window_end=TICK_IN_TO_WINDOW_END + 2 * self.slots - 1,
            index=self.count_latency + 1 + self.parallel,
        )

    @property
    def latency_entries(self) -> dict[str, int]:
        """Latencies in the manifest, in clocks."""
        latency = self.latency
        found = {
            "pin_to_count": latency.pin_to_count,
            "tick_latency": latency.tick,
            "tick_to_velocity": latency.tick_to_velocity,
        }
        external = {"tick_in_to_window_end": latency.tick_in_to_window_end}
        return found | (external if self.tachometer.external_tick else {})

    @cached_property
    def recovery(self) -> AxesRecovery:
        """Clocks after which all is right again after an upset.

        Each axis is a core of its own whose clock is a round. Before that the slots go on to the end of their register,
        and turns that have begun end; after it each axis has its turn.
        """
        own, slots = self.axis.recovery.clocks, self.slots
        if own is None:
            return AxesRecovery(None)
        return AxesRecovery(own * slots + (1 << (slots - 1).bit_length()) + 2 * self.axis.tick.longest * slots)

    @cached_property
    def words(self) -> Words:
        """Texts about the core."""
        alone, axis, notes = self.tachometer, self.axis, tuple[str, ...]()
        if alone.max_speed is not None and axis.tick.max_count != alone.tick.max_count:
            looked = f"an axis is looked at {self.rounds} times in a tick, so it has at most as many counts"
            notes = (f"greatest speed: {looked}",)
        # A reciprocal is always looked up: there is no time between two axes to divide.
        table = axis.form.looked_up if isinstance(axis, SAxis) else None
        memory = None if table is None else ("table", table.depth, table.width)
        return replace(alone.words, notes=notes, memory=memory, division="")

    def tick_of(self, machines: int) -> str:
        """Return the shortest tick, from that of the core on, in which these datapaths end the turns of all axes."""
        spec, slots, timing = self.tachometer, self.slots, self.timing

        def enough(cycles: int) -> bool:
            axis = _possible(spec, self.axes, cycles)
            return axis is not None and axis.plan.machines <= machines

        turns = (1 + spec.external_tick) * (-(-self.axes // machines) * self.turn_cycles + slots)
        return next_written_time(max(turns, timing.tick_cycles), timing.clock_hz, enough)

    @property
    def turn_cycles(self) -> int:
        """Clocks for which an axis has the datapath."""
        return self.plan.cycles

    def at(self, axis: int) -> SAxis | TrackAxis:
        """Return the core that one of the axes is."""
        return self.axis.at(axis, self.delay(axis))

    def delay(self, axis: int) -> int:
        """Return clocks from the last look at an axis in a tick to what is shown of it."""
        return int(self.shown(axis, 0)) - int(self.look(axis, 0))

    def look(self, axis: int, number: Any) -> Any:
        """Return the clock in which the level of an axis is looked at for the `number`-th time, an array or not."""
        return number * self.slots + axis

    def tick_clock(self, axis: int, tick: Any) -> Any:
        """Return the clock in which `tick` is high for the `tick`-th tick of an axis, of a number or an array.

        All ticks are as long as nominal.
        """
        return self.shown(axis, (tick + 1) * self.rounds - 1)

    def shown(self, axis: int, last: Any) -> Any:
        """Return the clock in which `tick` is high for a tick of an axis that ends with the round `last`."""
        begun = self.look(0, last) + self.count_latency + 1 + self.tachometer.front_end.index_resets
        return begun + self.plan.start(axis) + self.plan.latency + self.parallel

    @cached_property
    def ports(self) -> Ports:
        """Ports of the exported core, in order."""
        return Ports((*self._inputs(), *self._strobed(), *(self._held() if self.parallel else ())))

    def _inputs(self) -> Iterable[Port]:
        spec = self.axis
        for port in (*spec.ports[:2], *spec.ports.pins):
            if port.name in ("clk", "rst", "tick_in"):
                yield port
            else:
                yield pin(port.name, f"Bit k, of axis k: {port.help}", self.axes)

    def _strobed(self) -> Iterable[Port]:
        """Return strobes and what axis they are of; what is new with them, if it is not held for each axis."""
        last = (self.axes - 1).bit_length() or 1
        for port in self._of_an_axis():
            if not port.is_strobe:
                if not self.parallel:
                    yield port
                continue
            yield strobe(port.name, _STROBES[port.name])
            if port.name not in (UPDATE, "tick_error"):
                name = "axis" if port.name == TICK else f"{port.name.removesuffix('_valid')}_axis"
                yield held(port.name, name, last, help=f"The axis, from 0, that {port.name} is of.")

    def _held(self) -> Iterable[Port]:
        for port in self._of_an_axis():
            if port.is_strobe:
                continue
            for axis in range(self.axes):
                yield replace(port, name=f"{port.name}_{axis}", help=f"Of axis {axis}, held: {port.help}")

    def _of_an_axis(self) -> tuple[Port, ...]:
        """Return those of the core that each axis is, whose clocks are rounds, in clocks of this core."""
        unit = next(port.unit for port in self.tachometer.ports if port.name == "interval")
        return tuple(replace(port, unit=unit) if port.name == "interval" else port for port in self.axis.ports.outputs)

    @property
    def options(self) -> dict[str, str]:
        """Texts of all options that are asked for, by their names."""
        return {**self.tachometer.options, "axes": str(self.axes), "parallel": ("no", "yes")[self.parallel]}

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults included."""
        source = {"reciprocal_source": "table"} if isinstance(self.axis, SAxis) else {}
        found = source | {"axes": self.axes, "parallel": self.parallel}
        return {**self.tachometer.parameters, **found}

    @property
    def entries(self) -> dict[str, Any]:
        """Entries of the manifest, see `TachometerSpec.entries`."""
        alone, axis = self.tachometer, self.axis
        of_one, times = alone.entries, axis.times
        external = {"min": times.min_tick_cycles * self.slots, "max": axis.tick.longest * self.slots}
        of_velocity = {
            "width": axis.velocity.width,
            "full_scale": axis.velocity.full_scale * 2.0**-axis.velocity.frac_bits,
            "full_scale_rad_per_s": axis.velocity.full_scale * axis.velocity.rad_per_s_per_lsb,
        }
        return of_one | {
            "velocity": of_one["velocity"] | of_velocity,
            **axis.method_entries,
            **({} if self.recovery.clocks is None else {"recovery_cycles": self.recovery.clocks}),
            **({"external_tick_cycles": external} if alone.external_tick else {}),
            "axes": {
                "axes": self.axes,
                "parallel": self.parallel,
                "round_cycles": self.slots,
                "turn_cycles": self.turn_cycles,
                "machines": self.plan.machines,
                "first_tick": self.tick_clock(0, 0),
            },
            "latency_cycles": self.latency_entries,
        }


CoreSpec = TachometerSpec | AxesSpec
