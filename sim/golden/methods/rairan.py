"""Golden model of Rairán 2013: Table 1, window by window, with what docs/concepts/rairan.md adds to it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.adaptive import adaptive_windows
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.signals.run import Table
from tachometry.spec import RairanTachometer

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Windows:
    """Has one row per window: from the count that opens it, or from reset, to the next that opens one."""

    # shape (n,): clocks of both counts; reset is clock −1, and the end of the last window lies beyond all clocks
    start: Ints
    end: Ints
    sign: Ints  # shape (n,): direction in it; 0 as long as there was no count
    turns: Bools  # shape (n,): the count at its end is one against that direction
    c_ep: Ints  # shape (n,): counts in its first dt
    in_step: Bools  # shape (n,): its first dt has no count but the one that opened it
    n_dt: Ints  # shape (n,): dt that end in it
    shift: Ints  # shape (n,): k, its dt being 2^k nominal ones


def orbit(following: Ints, first: int) -> Ints:
    """Return first, following[first], … without the last index, which follows itself.

    `jump` leads from a node as many nodes on as the path has, so that each step doubles the path.
    """
    path, jump = np.array([first]), following
    while path[-1] != len(following) - 1:
        path = np.concatenate([path, jump[path]])
        jump = jump[jump]
    return path[path != len(following) - 1]


def windows(spec: RairanTachometer, steps: Steps, n_clocks: int) -> Windows:
    """Return all windows that are open in clocks 0 … n_clocks − 1."""
    counted = (steps.step != 0) & (steps.clock < n_clocks)
    at, sign = steps.clock[counted], steps.step[counted]
    n, dt, exact = len(at), spec.timing.tick_cycles, spec.paper_exact
    # Node 0 is the reset, node k the k-th count, node n + 1 the end of time. The first count opens a window.
    start = np.concatenate([[-1], at, [n_clocks]])
    turns = np.zeros(n + 2, dtype=np.bool_)
    if not exact:
        turns[2 : n + 1] = sign[1:] != sign[:-1]
    next_turn = np.minimum.accumulate(np.where(turns, np.arange(n + 2), n + 1)[::-1])[::-1]
    if spec.adaptive is not None:
        node, then, shift = adaptive_windows(spec, start, next_turn)
    else:
        # The first count after dt, or with its end, or the first against the direction.
        after_dt = 1 + np.searchsorted(at, start[:-1] + dt, side="right" if exact else "left")
        following = np.append(np.minimum(after_dt, next_turn[1:]), n + 1)
        following[0] = following[0] if exact else 1
        node = orbit(following, 0)
        then, shift = following[node], np.zeros_like(node)
    length = dt << shift
    counts_before_end = np.searchsorted(at, start[node] + length, side="left")
    c_ep = np.where((node > 0) | exact, counts_before_end - np.maximum(node - 1, 0), 0)
    within = np.maximum(start[then] - start[node] - 1, 0)
    # A count at the very end of the first dt leaves it whole.
    whole = (start[then] - start[node] == length) & ~turns[then] & (then <= n) & ((node > 0) | exact)
    signs = np.concatenate([[sign[0] if n else 0], sign, [0]])
    return Windows(
        start=start[node],
        end=np.where(then <= n, start[then], np.iinfo(np.int64).max),
        sign=np.ones(len(node), dtype=np.int64) if exact else signs[node],
        turns=turns[then],
        c_ep=c_ep,
        in_step=(c_ep == 1) & (node > 0),
        n_dt=within // length + (whole & (within // length == 0)),
        shift=shift,
    )


@dataclass(frozen=True)
class Events:
    """Has one row per update: its outputs, and the clock that causes it."""

    clock: Ints
    n: Ints
    high: Bools
    sign: Ints
    forced: Bools
    standstill: Bools
    n_ep1: Ints
    n_dt1: Ints
    shift: Ints
    # Of the bounds: the least speed is 0; the count that the measurement began with was not in step with dt; valid.
    loose: Bools
    unsynced: Bools
    valid: Bools


def latest(marked: Bools, values: Ints, first: int) -> Ints:
    """Return value of the last marked row so far, `first` before there is one; shape (n,)."""
    row = np.maximum.accumulate(np.where(marked, np.arange(1, len(marked) + 1), 0))
    return np.append(first, values)[row]


def counting(lengths: Ints) -> Ints:
    """Return 0 … length − 1 for each length, one after the other."""
    return np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)


class Model:
    """Computes the method of Rairán."""

    def __init__(self, spec: RairanTachometer) -> None:
        self._spec = spec

    def windows(self, steps: Steps, n_clocks: int) -> tuple[Ints, Bools, Ints]:
        """Return last clocks of all ticks, whether Nep1 is saturated in them, and nominal ticks that they are long."""
        found, dt = windows(self._spec, steps, n_clocks), self._spec.timing.tick_cycles
        nth = counting(found.n_dt)
        last = np.repeat(found.start, found.n_dt) + (nth + 1) * np.repeat(dt << found.shift, found.n_dt)
        beyond = (nth == 0) & np.repeat(found.c_ep > self._spec.tick.max_count << found.shift, found.n_dt)
        return last, beyond, np.repeat(1 << found.shift, found.n_dt)

    def updates(self, ticks: Table, steps: Steps, n_clocks: int) -> Table:
        """Return all updates below `n_clocks` clocks, with the velocity in counts per tick as the datapath has it."""
        spec = self._spec
        delay = spec.latency.tick + spec.latency.datapath
        found = windows(spec, steps, n_clocks - delay)
        events = self._to_the_letter(found) if spec.paper_exact else self._events(found)
        columns = {
            "velocity": self._velocity(events),
            "interval": np.where(events.high | (events.n == 0), 1, events.n) << events.shift,
            "forced": events.forced,
            "rests": events.standstill,
            "n_ep1": events.n_ep1,
            "n_dt1": events.n_dt1,
            "dt_shift": events.shift,
        }
        return Table(events.clock + delay, columns | self._bounds(events))

    def _bounds(self, events: Events) -> dict[str, NDArray[Any]]:
        """Return n2 and n1 of a time that is a clock longer and shorter, rounded outward; all in eighths of a count."""
        spec, one = self._spec, self._spec.timing.tick_cycles
        if not spec.bounds:
            return {}
        dt = one << events.shift
        n, high, none = events.n, events.high, spec.velocity.absent_bound
        bits, off = spec.velocity.native_frac_bits, int(8 * spec.bound.edge_error)
        least, most = 8 * np.where(high, n - 1, 1) - off, 8 * np.where(high, n, 1) + off
        lower = round_quotient(least * one, 8 * np.where(high, dt + 1, (n + 1) * dt + 1), bits, -1)
        # Where no least speed is implied, two edges may be off for all that.
        alone = np.full_like(n, -off * one)
        alone = round_quotient(alone, 8 * np.maximum(n * dt - 1, 1), bits, -1)
        alone[(n * dt <= 1) & (off > 0)] = -none
        lower = np.where(events.loose, np.maximum(alone, -none), lower)
        lower[n == 0] = 0
        time = np.where(high, 1, n - events.unsynced) * dt - 1
        upper = round_quotient(most * one, 8 * np.maximum(time, 1), bits, 1)
        upper = np.where((time <= 0) | (n == 0), none, np.minimum(upper, none))
        lower = np.minimum(lower, none)
        back = events.sign < 0
        return {
            "velocity_lower": np.where(back, -upper, lower),
            "velocity_upper": np.where(back, -lower, upper),
            "bounds_valid": events.valid,
        }

    def _alternating(self, found: Windows) -> tuple[Ints, Ints, Bools, Bools, Ints]:
        """Return what can happen in a window, in order: the end of its first dt, then the count that ends it.

        Clocks, Nep1 or Ndt1, whether it is Nep1, whether it happens, and direction; shape (2n,).
        """
        spec = self._spec
        n_ep = np.minimum(found.c_ep, spec.tick.max_count << found.shift)
        n_dt = np.clip(found.n_dt, 1, spec.timing.max_ticks >> found.shift)
        shape = (len(found.start), 2)
        clock = np.stack([found.start + (spec.timing.tick_cycles << found.shift), found.end], axis=1)
        happens = np.stack([(found.n_dt > 0) & (n_ep > 0), found.end < np.iinfo(np.int64).max], axis=1)
        return (
            clock.ravel(),
            np.stack([n_ep, n_dt], axis=1).ravel(),
            np.broadcast_to([True, False], shape).ravel(),
            happens.ravel(),
            np.repeat(found.sign, 2),
        )

    def _regime(self, value: Ints, is_nep: Bools, happens: Bools, anew: Bools) -> tuple[Bools, Ints, Bools]:
        """Return which events set n, n after each, and whether that is Nep1; `anew` are those that set n to 0."""
        # 1 for Nep1 ends the high regime, for Ndt1 it leaves it; what else happens sets it.
        sets_regime = happens & (is_nep | (value > 1) | anew)
        regime = latest(sets_regime, (is_nep & (value > 1)).astype(np.int64), 0) == 1
        before = np.append(False, regime[:-1])
        alone = is_nep & (value == 1)
        sets = happens & (anew | (value > 1) | np.where(alone, before, ~before))
        if self._spec.paper_exact:
            sets |= happens & alone & (np.cumsum(happens) == 1)
        return sets, latest(sets, np.where(anew, 0, value), 0), regime

    def _events(self, found: Windows) -> Events:
        spec = self._spec
        dt, most = spec.timing.tick_cycles << found.shift, spec.timing.max_ticks >> found.shift
        clock, value, is_nep, happens, sign = self._alternating(found)
        turns = ~is_nep & np.repeat(found.turns, 2)
        sign = np.where(turns, -sign, sign)
        nth = np.arange(len(found.start)) > 0  # the first window is not one that a count opened
        rests = found.n_dt >= most
        fresh = ~turns & ~is_nep & np.repeat(~nth | rests, 2)  # after reset or rest a count is no measurement
        sets, n, high = self._regime(value, is_nep, happens, turns | fresh)
        sets &= ~fresh
        loose = is_nep & np.repeat(found.c_ep == 1, 2)
        unsynced = np.stack([np.zeros_like(nth), ~found.in_step & (found.end > found.start + dt)], axis=1).ravel()
        shift = np.repeat(found.shift, 2)
        # With no count for long, from what the end of the first dt left: how many dt may pass without contradiction.
        n0, high0 = n[::2], high[::2]
        least = np.where(high0, 0, n0 << latest(sets, shift, 0)[::2] >> found.shift) + 1 + ~found.in_step
        alone = found.end > found.start + dt
        n_forced = np.maximum(0, np.minimum(found.n_dt, most - 1) - least + 1)
        n_forced = np.where((n0 > 0) & alone & spec.bound_decay, n_forced, 0)
        whole = counting(n_forced) + np.repeat(least, n_forced)
        forced_at = np.repeat(found.start, n_forced) + whole * np.repeat(dt, n_forced)
        rest_at = (found.start + most * dt)[rests]
        # A count just at the end of dt is one update with it: the later of both.
        sets = sets & ~np.append((clock[:-1] == clock[1:]) & sets[1:], False)
        clock = np.concatenate([clock[sets], forced_at, rest_at])
        n = np.concatenate([n[sets], whole - np.repeat(~found.in_step, n_forced), np.zeros_like(rest_at)])
        forced = np.arange(len(clock)) >= np.count_nonzero(sets)
        high = np.append(high[sets], np.zeros(np.count_nonzero(forced), dtype=np.bool_))
        sign = np.concatenate([sign[sets], np.repeat(found.sign, n_forced), np.where(nth, found.sign, 1)[rests]])
        alone = forced[np.count_nonzero(sets) :]
        shift = np.concatenate([shift[sets], np.repeat(found.shift, n_forced), found.shift[rests]])
        loose, unsynced = np.append(loose[sets], alone), np.append(unsynced[sets], ~alone)
        order = np.argsort(clock, kind="stable")
        clock, n, high, sign, forced = clock[order], n[order], high[order], sign[order], forced[order]
        shift, loose, unsynced = shift[order], loose[order], unsynced[order]
        n_ep1 = np.where(high, n, np.minimum(n, 1))
        n_dt1 = np.where(high | (n == 0), 1, n)
        standstill, valid = forced & (n == 0), n > 0
        return Events(clock, n, high, sign, forced, standstill, n_ep1, n_dt1, shift, loose, unsynced, valid)

    def _to_the_letter(self, found: Windows) -> Events:
        clock, value, is_nep, happens, sign = self._alternating(found)
        _, n, high = self._regime(value, is_nep, happens, np.zeros_like(happens))
        n_ep1 = latest(happens & is_nep, value, 0)
        n_dt1 = latest(happens & ~is_nep, value, 1)
        never = np.zeros(np.count_nonzero(happens), dtype=np.bool_)
        rows = (clock[happens], n[happens], high[happens], sign[happens])
        n_ep1, n_dt1 = n_ep1[happens], n_dt1[happens]
        return Events(*rows, never, never, n_ep1, n_dt1, np.zeros_like(n_ep1), never, never, never)

    def _velocity(self, events: Events) -> Ints:
        """Return n1, n2 or n3 with its sign, in counts per tick, correctly rounded."""
        estimate, n, high = self._spec.estimate, events.n, events.high
        n_ep, n_dt = np.where(high, n, 1), np.where(high, 1, np.maximum(n, 1))
        if estimate == "n1":
            up, down = n_ep, n_dt
        elif estimate == "n2":
            # Eq. (6).
            up, down = np.where(high, n_ep - 1, 1), np.where(high, 1, n_dt + 1)
        else:
            # Eq. (11) of both.
            up = 2 * n_ep * np.where(high, n_ep - 1, 1)
            down = n_dt * np.where(high, n_ep - 1, 1) + n_ep * np.where(high, 1, n_dt + 1)
        return round_quotient(
            np.where(n == 0, 0, events.sign * up), down << events.shift, self._spec.velocity.native_frac_bits
        )
