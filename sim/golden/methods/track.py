"""Golden tracking method: the recursion of docs/concepts/track.md in integers, tick by tick."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.signals.run import Table
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking import LEVELS, STEP_BACK

REST, BEGUN, TRACKS = range(3)


def rounded(product: int, bits: int) -> int:
    """Return a product over 2^bits; from the middle, up."""
    return (product + (1 << bits >> 1)) >> bits


@dataclass(frozen=True)
class Windows:
    """Holds the counts of every tick.

    Parameters
    ----------
    number : list of int
        Counts, forward and backward ones alike.
    times : list of int
        Sum of the clocks from each to the end of the tick.
    places : list of int
        Sum of their places relative to the end of the tick, in half counts.
    last_time, last_place : list of int
        The same of the last count alone.
    moved : list of int
        Forward counts less backward ones.
    length : list of int
        Clocks of the tick.
    """

    number: list[int]
    times: list[int]
    places: list[int]
    last_time: list[int]
    last_place: list[int]
    moved: list[int]
    length: list[int]

    @classmethod
    def of(cls, steps: Steps, last: NDArray[np.int64]) -> "Windows":
        """Return the counts of windows that end with the clocks `last`."""
        counted = (steps.step != 0) & (steps.clock <= (last[-1] if len(last) else -1))
        clock, step = steps.clock[counted], steps.step[counted]
        window = np.searchsorted(last, clock)
        through = np.cumsum(step)
        end = np.append(0, through)[np.searchsorted(clock, last, side="right")]  # position at the end of each
        age, place = last[window] - clock, 2 * (through - end[window]) - step

        def summed(values: NDArray[np.int64]) -> list[int]:
            found = np.zeros(len(last), dtype=np.int64)
            np.add.at(found, window, values)
            return found.tolist()

        def latest(values: NDArray[np.int64]) -> list[int]:
            found = np.zeros(len(last), dtype=np.int64)
            found[window] = values  # the last one is written last
            return found.tolist()

        return cls(
            number=summed(np.ones_like(step)),
            times=summed(age),
            places=summed(place),
            last_time=latest(age),
            last_place=latest(-step),
            moved=np.diff(end, prepend=0).tolist(),
            length=np.diff(last, prepend=-1).tolist(),
        )


class Recursion:
    """Keeps the state, and changes it in every tick; all numbers are as `spec.formats.tracking` describes them.

    Parameters
    ----------
    spec : TrackTachometer
    """

    def __init__(self, spec: TrackTachometer) -> None:
        self._form = form = spec.form
        self._constants = spec.program.constants
        # What would be worked out for every count: fixed-point numbers of the spec's fractions.
        self._agile = spec.agile
        self._one, self._max_error = form.fixed(1), form.fixed(form.max_error)
        self._error, self._twice_error = form.fixed(form.edge_error), form.fixed(2 * form.edge_error)
        self._quarter_error = form.fixed(form.edge_error / 4)
        self._rest()

    def _anew(self) -> None:
        self.gap = self.mean = self.before = self.age = self.level = 0

    def _rest(self) -> None:
        self._anew()
        self.p = self.v = self.a = 0
        self.phase = REST

    def tick(self, windows: Windows, i: int, alone: bool, quiet: bool) -> None:
        """Take tick i; `alone`: only its last count; `quiet`: there was no count for the maximum time."""
        form, length, most = self._form, windows.length[i], self._constants
        self.gap += length
        more = rounded(self.a * length, form.unit_bits + form.extra_bits)
        self.p += rounded((self.v + (more >> 1)) * length, form.unit_bits)
        self.v += more
        if windows.number[i]:
            alone = alone or windows.number[i] > form.max_count
            number = 1 if alone else windows.number[i]
            times = windows.last_time[i] if alone else windows.times[i]
            places = (windows.last_place[i] if alone else windows.places[i]) << (form.frac_bits - 1)
            self._count(number, times, places, windows.moved[i])
        elif quiet:
            self._rest()
        else:
            self._late()
        self.v = max(-most["most_v"], min(self.v, most["most_v"]))
        self.a = max(-most["most_a"], min(self.a, most["most_a"]))

    def _count(self, number: int, times: int, places: int, moved: int) -> None:
        form = self._form
        if abs(moved) > form.max_count:
            self._anew()
            self.p = self.a = 0
            self.v = form.max_velocity if moved > 0 else -form.max_velocity
            self.phase = TRACKS
        elif self.phase == REST and number > 1:  # none of them is the first
            self._rest()
        elif self.phase == REST:
            self._anew()
            self.p, self.v, self.a, self.gap = places, 0, 0, times
            self.phase = BEGUN
        else:
            self.p -= moved << form.frac_bits
            if self.phase == BEGUN:
                self._second(times, places)
            else:
                self._track(number, times, places)

    def _moved_by_v(self, times: int) -> int:
        """Return v times the sum of some times."""
        return rounded(self.v * times, self._form.unit_bits)

    def _second(self, times: int, places: int) -> None:
        """Take the speed from the first count to this one, coarser by some bits."""
        form = self._form
        gap = max(self.gap - times, self._constants["least_gap"])
        e = places - self.p
        speed = (abs(e) << (form.unit_bits - form.start_bits)) // gap
        speed = min(speed, form.max_velocity >> form.start_bits) << form.start_bits
        self.v = speed if e >= 0 else -speed
        self.p = places + self._moved_by_v(times)
        self._anew()
        self.a = 0
        self.phase = TRACKS

    def _track(self, number: int, times: int, places: int) -> None:
        form = self._form
        total = places + self._moved_by_v(times)
        e = (abs(total) // number if total >= 0 else -(abs(total) // number)) - self.p
        if abs(e) >= self._max_error:
            self._rest()
            return
        sign = 1 if e >= 0 else -1
        agile = self._agile and (
            abs(e) >= self._twice_error or (abs(e) >= self._error and sign * self.before >= self._quarter_error)
        )
        if self._agile:
            self.before = e
        if form.growing:
            self._remember(e, agile)
        x = self._reach(form.agile_rate, form.most_x[0]) if agile else self._level_reach
        one, bits = self._one, form.gain_bits
        d = (3 * x << bits) // (rounded((x + 3 * one) ** 2, form.frac_bits + 2) + (3 * one >> 2))
        of_r = bits - form.ratio_range
        r = (d << form.unit_bits) // (self.gap << form.ratio_range)
        e1 = rounded(e * d, bits)
        e2 = rounded(e1 * d, bits)
        e3 = rounded(e2 * d, bits)
        h = rounded(e1 * r, of_r)
        self.p += 3 * e1 - 3 * e2 + e3
        self.a += rounded(h * r, of_r - form.extra_bits)
        i = rounded(h * d, bits)
        self.v += 3 * h - (i + (i >> 1))
        self.gap = 0

    def _reach(self, rate: int, most: int) -> int:
        """Return x = λ·m·T_s, at most so much."""
        return min(rounded(rate * self.gap, self._form.gap_bits - 1), most)

    @property
    def _level_reach(self) -> int:
        """x of the level."""
        return self._reach(self._form.rates[self.level], self._form.most_x[self.level])

    def _remember(self, e: int, agile: bool) -> None:
        """Keep the mean error, and what follows for λ."""
        form, share = self._form, self._level_reach >> 2
        self.mean += rounded((e - self.mean) * share, form.frac_bits)
        size = min(abs(self.mean), self._one)
        limit = rounded(share * form.mean_threshold, form.mean_threshold_bits)
        self.age += self.gap
        if agile:
            self.age = self.level = 0
        elif rounded(size * size, form.frac_bits) > limit:
            self.mean >>= 1
            self.age, self.level = 0, max(self.level - STEP_BACK, 0)
        elif self.age >= form.spans[self.level]:
            self.age, self.level = 0, min(self.level + 1, LEVELS - 1)

    def _late(self) -> None:
        """Keep p near the position where no count has come, and let a speed fall that leads away from it."""
        form = self._form
        sign = 1 if self.p >= 0 else -1
        if abs(self.p) < form.late_limit:
            return
        self.p = sign * form.late_limit
        if sign * self.v >= 0:
            self.v = sign * min(abs(self.v), (self._one << form.unit_bits) // self.gap)
            self.a = sign * min(sign * self.a, 0)


class Model:
    """Computes the tracking method.

    Parameters
    ----------
    spec : TrackTachometer
    """

    def __init__(self, spec: TrackTachometer) -> None:
        self._spec = spec

    def updates(self, ticks: Table, steps: Steps, n_clocks: int) -> Table:
        """Return all updates of the clocks below `n_clocks`, with the velocity in counts per tick as the datapath shows
        it.
        """
        spec, form = self._spec, self._spec.form
        windows = Windows.of(steps, ticks.clock - spec.latency.tick)
        state = Recursion(spec)
        factor, shift = spec.program.acceleration_scale
        velocity_shift, fine_shift = spec.program.velocity_shift, form.frac_bits - spec.fine_bits
        half, lead = 1 << (spec.position_width + spec.fine_bits - 1), spec.program.lead
        rows: list[tuple[int, int, int, int]] = []
        silent = spec.timing.max_ticks  # ticks in a row before this one; the time before reset was silent
        phase = before = REST
        for i, position in enumerate(ticks.position.tolist()):
            elapsed = min(silent + 1, spec.timing.max_ticks)
            counted = windows.number[i] > 0
            # What the two ticks before have made known decides as early as this tick begins.
            alone = silent > 0 or before != TRACKS
            state.tick(windows, i, alone, elapsed == spec.timing.max_ticks)
            before, phase = phase, state.phase
            silent = 0 if counted else elapsed
            ahead = state.v + rounded(state.a * lead, form.unit_bits + form.extra_bits)
            ahead = max(-form.max_velocity, min(ahead, form.max_velocity))
            velocity = rounded(ahead * form.tick_cycles, velocity_shift)
            acceleration = rounded(state.a * factor, shift)
            fine = (position << spec.fine_bits) + rounded(state.p, fine_shift)
            rows.append((velocity, acceleration, (fine + half) % (2 * half) - half, elapsed))
        shown = np.array(rows, dtype=np.int64).reshape(-1, 4).T
        columns = {
            "velocity": shown[0],
            "interval": shown[3],
            "forced": np.array(windows.number) == 0,
            "acceleration": shown[1],
            "position_fine": shown[2],
        }
        return Table(ticks.clock + spec.latency.datapath, columns)
