"""Golden model of a run of any length: it takes the pins in pieces, and needs memory for one of them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden import model
from tachometry.sim.golden.front_end import MOST_FILTERED, Steps, count, decoded
from tachometry.sim.golden.output import in_unit, with_whole
from tachometry.sim.golden.standstill import with_standstill
from tachometry.sim.signals.recording import PinTrace, packed
from tachometry.sim.signals.run import Run, Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.sensors import packed_levels
from tachometry.spec.language.port import INDEX, MISSED, TICK, WIDE


def in_pieces(spec: TachometerSpec) -> bool:
    """Return whether the golden model of a core can be run in pieces: others need the whole of a run at once."""
    whole = (spec.facts.own_ticks, spec.external_tick, spec.age, spec.lowpass, spec.front_end.wheel)
    return not (any(whole) or spec.extras or spec.encoder.sampled)


class Golden:
    """Golden model of a core that is run piece by piece, with `in_pieces`."""

    def __init__(self, spec: TachometerSpec) -> None:
        self._spec, self._model = spec, model(spec)
        self._pins: PinTrace | None = None  # those whose steps come later, and some before
        self._from = self._n_clocks = self._n_ticks = 0  # first clock of `_pins`; clocks and ticks of all pieces
        self._steps: Steps | None = None  # those after the last tick
        self._position = self._filtered = self._turned = 0
        self._homed = self._armed = False  # whether the index was taken; whether it is to be taken
        self._silent = 1  # ticks in a row without a count

    def run(self, pins: PinTrace) -> Run:
        """Return the next rows of all tables, given the next pins. Updates may come with a later piece, or before
        their clock.
        """
        spec, begin, late = self._spec, self._n_clocks, self._spec.latency.tick
        self._n_clocks = end = begin + pins.n_clocks
        steps = new = self._decoded(pins).part(begin)
        if self._steps is not None:
            steps = self._steps.then(steps)
        cycles, before = spec.timing.tick_cycles, np.array([self._n_ticks * spec.timing.tick_cycles - 1])
        last = np.arange(before[0] + cycles, end - late, cycles, dtype=np.int64)
        self._n_ticks += len(last)
        # What has been counted is as a preset at the last tick.
        presets, values = np.append(before, steps.presets), np.append(self._position, steps.values)
        asked = steps.asked(spec, presets, values, np.append(before[: self._armed], steps.arms))
        ticks, index = count(spec, replace(asked, turned=self._turned, homed=self._homed), last)
        ticks = self._continued(ticks, asked)
        updates = in_unit(spec, self._model.updates(ticks, asked, end))
        shown = cycles * self._n_ticks - 1 + late  # clock of the last tick
        glitches = steps.swallowed[np.searchsorted(steps.swallowed, shown, side="right") :]
        self._steps = replace(steps.part(cycles * self._n_ticks), swallowed=glitches)
        found = {"tick": ticks, **with_whole(spec, updates), INDEX: index.rows(index.clock >= begin + late)}
        events = {WIDE: new.wide + late, MISSED: new.missed + late, "decode_error": new.errors}
        return Run.of_ports(spec, end, found | {name: Table(clock, {}) for name, clock in events.items()})

    def _decoded(self, pins: PinTrace) -> Steps:
        """Return steps on the clock of all pieces, up to the end of this one; some are known already."""
        spec, begin = self._spec, self._from
        pins = pins if self._pins is None else self._pins.then(pins)
        steps = decoded(spec, pins)
        # From a row on that all lines have had for long enough, all is as if what came before were known.
        lasts, sensor = np.diff(pins.clock, append=pins.n_clocks), spec.encoder.kind
        place = packed([pins.lines[name] ^ np.uint8(name in spec.encoder.inverted) for name in sensor.lines])
        settled = lasts > spec.filter_clocks + spec.blanking_clocks
        settled &= np.isin(place, [packed_levels(each) for each in sensor.legal])
        settled &= pins.clock + lasts + spec.latency.pin_to_count < pins.n_clocks
        left_out = np.zeros(len(place), dtype=np.bool_)
        if (state := spec.front_end.index_state) is not None:
            settled, left_out = self._of_index(pins, steps, settled, settled & (place == packed_levels(state)))
        row = np.append(0, np.flatnonzero(settled))[-1]
        rows = row + np.flatnonzero(~left_out[row:])
        first, lines = int(pins.clock[row]), {name: line[rows] for name, line in pins.lines.items()}
        self._pins, self._from = (
            PinTrace.of_lines(pins.clock[rows] - first, pins.n_clocks - first, lines),
            begin + first,
        )
        return steps.part(0, pins.n_clocks, later=begin)

    def _of_index(
        self, pins: PinTrace, steps: Steps, settled: NDArray[np.bool_], here: NDArray[np.bool_]
    ) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return settled rows between two steps from before the first of which Z has been low: what it did is told.

        And rows that tell nothing: while Z is high, those from a settled row in its state to another before a step.
        """
        high = pins.lines["z"] != np.uint8("z" in self._spec.encoder.inverted)
        stepped = steps.clock[steps.step != 0] - self._spec.latency.pin_to_count
        after = np.searchsorted(stepped, pins.clock, side="right")  # the step after each row
        sums = np.append(0, np.cumsum(high))
        since, until = (
            np.searchsorted(pins.clock, stepped[:-1] - 1, side="right") - 1,
            np.searchsorted(pins.clock, stepped[1:]),
        )
        quiet = np.concatenate([[False], sums[since] == sums[until], [False]])[after]
        time = np.cumsum(~high)  # a number for each time of Z
        begin, end = (np.searchsorted(time, time, side=side) for side in ("left", "right"))
        here = here & high & (after < after[end - 1])
        for name in self._spec.front_end.controls:
            here &= pins.lines[name] == 0
        met = np.append(0, np.cumsum(here))
        return settled & quiet, (met[:-1] > met[begin]) & (met[:-1] < met[end])

    def _continued(self, ticks: Table, steps: Steps) -> Table:
        """Return ticks with what came before them, and keep what the next ones need."""
        spec = self._spec
        if spec.filter_clocks:
            ticks = ticks.having(filtered_edges=np.minimum(ticks.filtered_edges + self._filtered, MOST_FILTERED))
        if spec.facts.rests_with == TICK:
            ticks = with_standstill(spec, ticks, np.ones(len(ticks), dtype=np.int64), self._silent)
        if len(ticks):
            counted = np.flatnonzero(ticks.pulse_count)
            self._silent = len(ticks) - 1 - int(counted[-1]) if len(counted) else self._silent + len(ticks)
            last = {name: int(ticks.get(name)[-1]) for name in ("position", "filtered_edges", "turned", "homed")}
            self._position, self._filtered, self._turned, homed = last.values()
            armed = np.searchsorted(steps.arms + spec.latency.tick, ticks.clock[-1], side="right") > 0
            self._homed, self._armed = bool(homed), bool(armed) and not homed
        return ticks
