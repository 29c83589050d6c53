"""Golden model of a run of any length: it takes the pins in pieces, and needs memory for one of them."""

from dataclasses import replace

import numpy as np

from tachometry.sim.golden import model
from tachometry.sim.golden.front_end import Steps, count, decoded, wrapped
from tachometry.sim.golden.output import in_unit, with_whole
from tachometry.sim.golden.standstill import with_standstill
from tachometry.sim.signals.recording import PinTrace, packed
from tachometry.sim.signals.run import Run, Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.sensors import packed_levels
from tachometry.spec.language.port import TICK


def in_pieces(spec: TachometerSpec) -> bool:
    """Return whether the golden model of a core can be run in pieces: others need the whole of a run at once."""
    whole = (spec.facts.own_ticks, spec.external_tick, spec.age, spec.lowpass, spec.index, spec.front_end.wheel)
    return not (any(whole) or spec.extras or spec.front_end.controls or spec.encoder.sampled)


class Golden:
    """Golden model of a core that is run piece by piece, with `in_pieces`."""

    def __init__(self, spec: TachometerSpec) -> None:
        self._spec, self._model = spec, model(spec)
        self._pins: PinTrace | None = None  # those whose steps come later, and some before
        self._from = self._n_clocks = self._n_ticks = 0  # first clock of `_pins`; clocks and ticks of all pieces
        self._steps: Steps | None = None  # those after the last tick
        self._position = self._filtered = 0
        self._silent = 1  # ticks in a row without a count

    def run(self, pins: PinTrace) -> Run:
        """Return the next rows of all tables, given the next pins. Updates may come with a later piece, or before
        their clock.
        """
        spec, begin = self._spec, self._n_clocks
        self._n_clocks = end = begin + pins.n_clocks
        steps = self._decoded(pins).since(begin)
        errors = Table(steps.errors, {})
        if self._steps is not None:
            steps = self._steps.then(steps)
        cycles = spec.timing.tick_cycles
        last = np.arange(cycles * (self._n_ticks + 1) - 1, end - spec.latency.tick, cycles, dtype=np.int64)
        self._n_ticks += len(last)
        ticks = self._continued(count(spec, steps, last)[0])
        updates = in_unit(spec, self._model.updates(ticks, steps, end))
        shown = cycles * self._n_ticks - 1 + spec.latency.tick  # clock of the last tick
        glitches = steps.swallowed[np.searchsorted(steps.swallowed, shown, side="right") :]
        self._steps = replace(steps.since(cycles * self._n_ticks), swallowed=glitches)
        return Run.of_ports(spec, end, {"tick": ticks, **with_whole(spec, updates), "decode_error": errors})

    def _decoded(self, pins: PinTrace) -> Steps:
        """Return steps on the clock of all pieces, up to the end of this one; some are known already."""
        spec, begin = self._spec, self._from
        pins = pins if self._pins is None else self._pins.then(pins)
        steps = decoded(spec, pins)
        clock, errors, swallowed = (
            at[: np.searchsorted(at, pins.n_clocks)] + begin for at in (steps.clock, steps.errors, steps.swallowed)
        )
        # From a row on that all lines have had for long enough, all is as if what came before were known.
        lasts = np.diff(pins.clock, append=pins.n_clocks)
        lines = [pins.lines[name] ^ np.uint8(name in spec.encoder.inverted) for name in spec.encoder.kind.lines]
        settled = lasts > spec.filter_clocks + spec.blanking_clocks
        settled &= np.isin(packed(lines), [packed_levels(each) for each in spec.encoder.kind.legal])
        settled &= pins.clock + lasts + spec.latency.pin_to_count < pins.n_clocks
        first = int(pins.clock[np.append(0, np.flatnonzero(settled))[-1]])
        self._pins, self._from = pins.part(first, pins.n_clocks), begin + first
        return Steps(clock, steps.step[: len(clock)], errors, errors[:0], swallowed)

    def _continued(self, ticks: Table) -> Table:
        """Return ticks with what came before them."""
        spec = self._spec
        columns = {"position": wrapped(ticks.position + self._position, spec.position_width)}
        if spec.filter_clocks:
            columns["filtered_edges"] = np.minimum(ticks.filtered_edges + self._filtered, 2 * (1 << 15) - 2)
        ticks = ticks.having(**columns)
        if spec.facts.rests_with == TICK:
            ticks = with_standstill(spec, ticks, np.ones(len(ticks), dtype=np.int64), self._silent)
        if len(ticks):
            counted = np.flatnonzero(ticks.pulse_count)
            self._silent = len(ticks) - 1 - int(counted[-1]) if len(counted) else self._silent + len(ticks)
            self._position = int(ticks.position[-1])
            self._filtered = int(ticks.get("filtered_edges")[-1])
        return ticks
