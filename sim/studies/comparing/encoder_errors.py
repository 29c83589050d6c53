"""Corrections of a disc, learned from its own edges: what is gained if each count is known where it really lies.

A *class* is what edges have in common that shares a correction: the four edges of a cycle of A and B, or every edge of
the disc. The coordinate of a count is the edge that it is of, in counts, from the position alone, or with the learned
offset of its class. All is in double precision, and times are not quantised.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.studies.comparing.baselines import Estimate, IntArray, Steps
from tachometry.sim.theory.tracking import Recursion, Tuning

CYCLE = 4  # edges in a cycle of A and B


@dataclass(frozen=True, eq=False)
class Counts:
    """The counts of an encoder, x4, with the edges that they are of.

    Parameters
    ----------
    steps : Steps
    edge : int64 array, shape (n,)
        Number of the edge that each count has passed, in either direction. An index tells it modulo the edges of the
        disc, the levels of A and B tell it modulo 4.
    """

    steps: Steps
    edge: IntArray

    @staticmethod
    def of(encoding: Encoding) -> "Counts":
        """Return of a recording that begins at time 0 with the lines as they are."""
        counts_per_rev = 4 * encoding.encoder.pulses_per_rev
        steps = Steps.of_recording(encoding.recording, counts_per_rev)
        disc = encoding.encoder.disc
        start = encoding.encoder.start_angle_rad + encoding.motion.angle(np.zeros(1))
        quarter = int(disc.quarter(start)[0])
        position = quarter + np.cumsum(steps.step)
        return Counts(steps, position + (steps.step < 0))

    def coordinate(self, offsets: FloatArray) -> FloatArray:
        """Tell where the edge of each count lies, in counts, with an offset for each class."""
        return self.edge + offsets[self.edge % len(offsets)]


@dataclass(frozen=True, eq=False)
class Learned:
    """Offsets of the classes in counts, as they became known.

    Parameters
    ----------
    history : float64 array, shape (m, classes)
        The mean of each row is 0.
    every : int
        Row r holds from count `every`·r on.
    """

    history: FloatArray
    every: int

    @property
    def offsets(self) -> FloatArray:
        """Those at the end."""
        last: FloatArray = self.history[-1]
        return last

    def coordinate(self, counts: Counts) -> FloatArray:
        """Tell where the edge of each count lies, by what was known when it came."""
        row = np.arange(len(counts.edge)) // self.every
        return np.asarray(counts.edge + self.history[row, counts.edge % self.history.shape[1]])


def perfect_offsets(encoding: Encoding, classes: int) -> FloatArray:
    """Return mean displacement of the edges of each class, in counts, less the mean of all."""
    of_disc = encoding.encoder.disc.offset
    found = np.resize(of_disc, math.lcm(len(of_disc), classes)).reshape(-1, classes).mean(axis=0)
    return np.asarray(found - found.mean())


def learn(counts: Counts, classes: int = CYCLE, least_rate: float = 1 / 128, slowest_s: float = math.inf) -> Learned:
    """Return offsets from a running average of each gap's share of a round.

    A *round* is as many counts in one direction as there are classes. At each count that completes one, the share of
    the gap before the count, its time over that of the round, is averaged: with 1/n in the n-th time, and never with
    less than `least_rate`. Rounds that last longer than `slowest_s` teach nothing.

    Each share is that of the last gap of its round. A steady acceleration makes all of them shorter alike, so it has no
    part in the offsets.
    """
    time, step, every = counts.steps.time.tolist(), counts.steps.step.tolist(), max(classes // CYCLE, 1)
    gap = ((counts.edge - (counts.steps.step > 0)) % classes).tolist()  # the edge with which it begins, seen forwards
    share, seen = [1 / classes] * classes, [0] * classes
    shares = []
    run = 0
    for j in range(len(time)):
        run = run + 1 if j and step[j] == step[j - 1] else 0
        if run >= classes:
            lasted = time[j] - time[j - classes]
            if 0 < lasted <= slowest_s:
                k = gap[j]
                seen[k] += 1
                share[k] += ((time[j] - time[j - 1]) / lasted - share[k]) * max(least_rate, 1 / seen[k])
        if j % every == 0:
            shares.append(share.copy())
    found = np.array(shares).reshape(-1, classes)
    longer = classes * found / found.sum(axis=1, keepdims=True) - 1
    places = np.cumsum(longer, axis=1) - longer
    return Learned(places - places.mean(axis=1, keepdims=True), every)


def by_counts(
    counts: Counts,
    coordinate: FloatArray,
    min_time_s: float,
    whole_cycles: bool = False,
    max_time_s: float = 0.01,
) -> Estimate:
    """Estimate by M/T, without decay, with coordinates for counts: from edge to edge over the time between."""
    steps = counts.steps
    time, edge, place, step = steps.time.tolist(), counts.edge.tolist(), coordinate.tolist(), steps.step.tolist()
    at, velocity = [], []
    opening, turned = -1, False
    for j in range(len(time)):
        if opening >= 0 and time[j] - time[j - 1] > max_time_s:
            at.append(time[j - 1] + max_time_s)
            velocity.append(0.0)
            opening = -1
        if opening < 0:
            opening, turned = j, False
            continue
        turned |= step[j] != step[j - 1]
        lasted, way = time[j] - time[opening], abs(edge[j] - edge[opening])
        if lasted <= min_time_s:
            continue
        if whole_cycles and not turned and way >= CYCLE and way % CYCLE and lasted <= 2 * min_time_s:
            continue
        at.append(time[j])
        velocity.append((place[j] - place[opening]) / lasted)
        opening, turned = j, False
    return Estimate(np.array(at), np.array(velocity) * steps.count_rad)


def by_tracking(counts: Counts, coordinate: FloatArray, tuning: Tuning) -> Estimate:
    """Return the tracking recursion of docs/concepts/track.md, with coordinates for counts."""
    steps, offset, state = counts.steps, coordinate - counts.edge, Recursion(tuning)
    ends = np.asarray(tuning.tick_seconds * np.arange(1, int(steps.duration / tuning.tick_seconds) + 1))
    until = np.searchsorted(steps.time, ends, side="right").tolist()
    velocity, begin = [], 0
    for end, now in zip(until, ends.tolist(), strict=True):
        ages = (now - steps.time[begin:end]).tolist()
        state.tick(tuning.tick_seconds, ages, steps.step[begin:end].tolist(), offset[begin:end].tolist())
        velocity.append(state.shown_velocity)
        begin = end
    return Estimate(np.asarray(ends + tuning.lead_seconds), np.array(velocity) * steps.count_rad)


def shifted(counts: Counts, forward: Sequence[float], backward: Sequence[float]) -> Counts:
    """Return the same counts with edges that lie elsewhere, by so many counts for each class and direction of passage.

    With hysteresis an edge comes later in either direction: forward > 0 and backward < 0. To first order, and by less
    than half of the gap to a neighbour.
    """
    steps = counts.steps
    gap = np.diff(steps.time, prepend=0.0, append=steps.duration)
    nearer = np.minimum(gap[:-1], gap[1:])
    by = np.where(
        steps.step > 0,
        np.asarray(forward)[counts.edge % len(forward)],
        -np.asarray(backward)[counts.edge % len(backward)],
    )
    time = steps.time + np.clip(by, -0.49, 0.49) * nearer
    return Counts(Steps(time, steps.step, steps.duration, steps.counts_per_rev), counts.edge)


def rms(estimate: Estimate, truth: FloatArray, instants: FloatArray) -> float:
    """Return RMS error of the held velocity at some instants (s), rad/s."""
    error: NDArray[np.float64] = estimate.at(instants) - truth
    return float(np.sqrt(np.mean(error * error)))
