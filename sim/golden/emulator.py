"""The golden encoder emulator computes every edge from the settings and the times at which they were written."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.recording import PinTrace
from tachometry.spec.registers.emulator import (
    BOUNCE_BITS,
    DROP_BITS,
    DROP_WIDTH,
    FINE_WIDTH,
    JITTER_WIDTH,
    NOISE_BIT,
    NOISE_WIDTH,
    PHASE_WIDTH,
    RANDOM_TAP,
    RANDOM_WIDTH,
    RATE_SHIFT,
    START,
    EmulatorSettings,
)

_CHUNK = 1 << 18  # clocks that are worked out at once
_TURN = 1 << FINE_WIDTH


@dataclass(frozen=True)
class Change:
    """Is a write to the emulator's registers."""

    clock: int  # of the write, since the restart; -1 for what was set before it
    settings: EmulatorSettings  # all that holds from the next clock on
    jump: bool = False  # the phase turns by half a period in this clock


class _Random:
    """Gives the random bits: the newest in clock t is bit t of a sequence."""

    def __init__(self) -> None:
        self._bits = np.zeros(RANDOM_WIDTH, dtype=np.uint8)
        self._bits[-1] = 1  # the newest bit in clock 0

    def until(self, n_clocks: int) -> None:
        """Make the bits up to this clock."""
        while len(self._bits) < n_clocks + RANDOM_WIDTH:
            # The recurrence holds for all lags twice as long, too: x^62 + x^56 + 1 is a square of x^31 + x^28 + 1.
            have, scale = len(self._bits), 1
            while 2 * scale * RANDOM_WIDTH <= have:
                scale *= 2
            long, short = RANDOM_WIDTH * scale, RANDOM_TAP * scale
            self._bits = np.append(self._bits, self._bits[-long : have - long + short] ^ self._bits[-short:])

    def bit(self, clock: NDArray[np.int64], place: int) -> NDArray[np.uint8]:
        """Return a bit of the register in some clocks."""
        return self._bits[clock + RANDOM_WIDTH - 1 - place]

    def number(self, clock: NDArray[np.int64], low: int, width: int) -> NDArray[np.int64]:
        """Return some bits of the register as a number."""
        return np.sum([self.bit(clock, low + k).astype(np.int64) << k for k in range(width)], axis=0)


class _Line:
    """Computes one line, see `hdl.core.line`."""

    def __init__(self, k: int, random: _Random) -> None:
        self._k, self._random = k, random
        self._ideal = self._before = self._level = self._line = self._whole = 0
        self._until = 0  # the line bounces in all clocks before this one

    def play(
        self, clock: NDArray[np.int64], ideal: NDArray[np.uint8], settings: EmulatorSettings
    ) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """Return levels in these clocks, and what they would be if no wire were broken; `ideal` is what the flip-flop
        takes at their ends.
        """
        seen = np.append(np.uint8(self._ideal), ideal)
        edges = np.flatnonzero(seen[:-1] != np.append(np.uint8(self._before), seen[:-2]))
        dropped = self._random.number(clock[edges], DROP_BITS[self._k], DROP_WIDTH) < settings.drop
        kept = edges[~dropped & (settings.stuck >> self._k & 1 == 0)]
        # What holds in the clocks after each kept edge, the one carried over first.
        which = np.zeros(len(clock) + 1, dtype=np.int64)
        which[kept + 1] = 1
        which = np.cumsum(which)
        level = np.append(np.uint8(self._level), seen[kept])[which]
        until = np.append(self._until, clock[kept] + 1 + settings.bounce)[which]
        bounces = (clock < until[:-1]) & (self._random.bit(clock, BOUNCE_BITS[self._k]) == 1)
        after = level[:-1] ^ bounces.astype(np.uint8)
        if settings.glitches:
            noise = self._random.number(clock, NOISE_BIT, 2 * NOISE_WIDTH) < settings.glitches
            after ^= noise.astype(np.uint8)
        whole = np.append(np.uint8(self._whole), after[:-1])
        self._whole = int(after[-1])
        after |= np.uint8(settings.broken >> self._k & 1)
        found = np.append(np.uint8(self._line), after[:-1])
        self._ideal, self._before = int(seen[-1]), int(seen[-2])
        self._level, self._until, self._line = int(level[-1]), int(until[-1]), int(after[-1])
        return found, whole


class GoldenEmulator:
    """Computes the emulator from a restart on."""

    def __init__(
        self, lines_per_rev: int | None = None, index_place: int = 0, complemented: tuple[str, ...] = ()
    ) -> None:
        self._lines_per_rev, self._index_place, self._complemented = lines_per_rev, index_place, complemented
        self._random = _Random()
        self._lines = [_Line(k, self._random) for k in range(2)]
        self._clock = self._speed = self._moved = self._turned = 0
        self._down = False
        self._total = START  # the phase, and whole periods above it
        self._between = 1
        self._z = [0, 0]

    def trace(self, changes: Sequence[Change], n_clocks: int) -> PinTrace:
        """Return the lines as a core would see them whose clock 0 is that of the restart; once for each emulator.

        The changes are in the order of their clocks.
        """
        held = [EmulatorSettings(), *(change.settings for change in changes)]
        ends = [*(min(change.clock + 1, n_clocks) for change in changes), n_clocks]
        jumps = [*(change.jump for change in changes), False]
        clocks, levels = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.uint8)]
        last = -1
        for settings, end, jump in zip(held, ends, jumps, strict=True):
            while self._clock < end:
                clock = np.arange(self._clock, min(end, self._clock + _CHUNK))
                level = self._play(clock, settings)
                changed = np.append(level[0] != last, level[1:] != level[:-1])
                clocks.append(clock[changed])
                levels.append(level[changed])
                last, self._clock = int(level[-1]), int(clock[-1]) + 1
            self._total ^= jump << PHASE_WIDTH - 1
        every = np.concatenate(levels)
        a, b, z = (every >> np.uint8(bit) & np.uint8(1) for bit in range(3))
        more = {f"{line}_n": every >> np.uint8(bit) & np.uint8(1) for bit, line in enumerate(self._complemented, 3)}
        return PinTrace(np.concatenate(clocks), a, b, n_clocks, None if self._lines_per_rev is None else z, more=more)

    def _speeds(self, n: int, target: int, rate: int) -> NDArray[np.int64]:
        """Return speeds in n clocks and in the one after; they change every second clock, by the finding before."""
        first = np.full(self._clock % 2, self._speed, dtype=np.int64)  # the second clock of a change that has begun
        speed = self._speed
        if len(first):
            passed = self._turned <= target if self._down else self._turned >= target
            moved = self._down != (target < speed)  # to the other side of the speed, since the first clock
            speed = target if not rate else speed if moved else target if passed else self._turned
        step = -rate if target < speed else rate
        ramp = speed + step * np.arange(n // 2 + 2, dtype=np.int64)
        if rate == 0:
            ramp[1:] = target
        ramp = np.maximum(ramp, min(target, speed)) if step < 0 else np.minimum(ramp, max(target, speed))
        found = np.append(first, np.repeat(ramp, 2))[: n + 1]
        if (self._clock + n) % 2:
            self._down = target < int(found[n])
            self._turned = int(found[n]) + (-rate if self._down else rate)
        return found

    def _play(self, clock: NDArray[np.int64], settings: EmulatorSettings) -> NDArray[np.uint8]:
        """Return a + 2 B + 4 Z in these clocks."""
        n = len(clock)
        self._random.until(self._clock + n)
        target = settings.speed << RATE_SHIFT
        speed = self._speeds(n, target, settings.rate)
        total = self._total + np.append(0, np.cumsum(speed[:n] >> RATE_SHIFT))
        self._speed, self._total = int(speed[n]), int(total[n])

        fine = (total[:n] >> PHASE_WIDTH - FINE_WIDTH) % _TURN
        between = (fine + _TURN // 8) // (_TURN // 4) % 4
        draws = np.flatnonzero(between != np.append(self._between, between[:-1]))
        late, early = (
            self._random.number(clock[draws], low, JITTER_WIDTH) & settings.jitter for low in (0, JITTER_WIDTH)
        )
        counts = np.diff(np.append(np.append(-1, draws), n))
        moved = np.repeat(np.append(self._moved, late - early), counts)
        self._between, self._moved = int(between[-1]), int(moved[-1] if draws.size == 0 else (late - early)[-1])

        since_a = (fine - moved[:n] - _TURN // 4) % _TURN
        since_b = (fine - moved[:n] - _TURN // 2 - settings.phase_error) % _TURN
        ideal = [since_a < _TURN // 2 + settings.duty_a, since_b < _TURN // 2 + settings.duty_b]
        (a, whole_a), (b, whole_b) = (
            line.play(clock, high.astype(np.uint8), settings) for line, high in zip(self._lines, ideal, strict=True)
        )
        whole = {"a": whole_a, "b": whole_b}
        level = a | b << np.uint8(1)
        if self._lines_per_rev is not None:
            index = ((total[:n] >> PHASE_WIDTH) % self._lines_per_rev == 0) & (fine * 4 // _TURN == self._index_place)
            z = np.append(np.array(self._z, dtype=np.uint8), index.astype(np.uint8))
            if settings.stuck & 4:
                z[:-1] = z[0]
            self._z = z[-2:].tolist()
            whole["z"] = z[:-2]
            level |= (z[:-2] | np.uint8(settings.broken >> 2)) << np.uint8(2)
        for bit, name in enumerate(self._complemented, 3):
            level |= (whole[name] ^ np.uint8(1)) << np.uint8(bit)
        return level
