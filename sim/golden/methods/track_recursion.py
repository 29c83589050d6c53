"""The tracking recursion in integers, tick by tick: docs/concepts/track.md has its rules, track.h its twin in C++."""

from typing import NamedTuple

from tachometry.spec.formats.tracking import (
    CHANCE_BITS,
    EXP_INDEX,
    GAIN_STEPS,
    GAINS,
    LOG_BITS,
    LOG_INDEX,
    LOGS,
    PLACE_BITS,
    POWER_BITS,
    POWERS,
    RESULT_BITS,
    Tracking,
)

REST, ONE, TRACKS = range(3)
# Velocity, place at the end of the tick, deviation to be expected, acceleration, whether the shaft stands still; with
# `smooth` velocity and age of the middle of the memory as it was before the tick.
Row = tuple[int, ...]
_HALF = 1 << CHANCE_BITS - 1


def log2(x: int) -> int:
    """Return the logarithm of |x|; of a negative one less 1, and that of 1 for 0."""
    size = max(~x if x < 0 else x, 1)
    whole = size.bit_length() - 1
    return (whole << LOG_BITS) + LOGS[((size << LOG_INDEX) >> whole) & (len(LOGS) - 1)]


def factor(x: int, bits: int) -> tuple[int, int]:
    """Return x > 0 as m and k, so that it is m·2^k: m has so many bits, eight of which are a fraction for a small x."""
    k = max(x.bit_length() - bits, -CHANCE_BITS) if x > 0 else -CHANCE_BITS
    return ((x << CHANCE_BITS) >> (k + CHANCE_BITS)) & ((1 << bits) - 1) if x > 0 else 0, k


class Expected(NamedTuple):
    """Place and velocity at an event as the state has them, and the memory with it."""

    p: int
    v: int
    memory: int
    log_dt: int


class Recursion:
    """Keeps the state, and changes it in every tick; all numbers are as `spec.formats.tracking` describes them.

    The velocity that is shown is `lead` clocks ahead of the end of the tick.
    """

    def __init__(self, form: Tracking, lead: int, *, smooth: bool = False) -> None:
        self._form, self._smooth = form, smooth
        self._k = k = form.constants
        self._lead = lead << form.time_bits
        self._gains = form.gains
        self.phase, self.turn, self.noises = REST, 0, k["noises_first"]
        self.p = self.v = self.a = self.shown_v = self.shown_a = 0
        self.memory = self.log_memory = self.slow_until = 0
        self.since = self.quiet = 0
        self.standstill = False
        self.noise = self.sure = self.certain = k["quarter"]  # D, D_s, D_a
        self.alarm, self.mean_alarm, self.slack, self.lost = 4 * self.certain, 0, 0, 0
        self.error = self.mean = self.lag = self.edge = self.slips = 0
        self.log_share = -k["log_4"]
        self.offsets = [0] * 4
        self.grows, self.log_growth = 1, 0
        self.log_limit, self.trouble = 2 * log2(self.noise) + k["order"], -k["log_9_4"]
        self._chance, self.velocity_std = _HALF, 0
        self.middle, self.held = (0, 0), (0, 0)  # velocity and age at `since`; those that are shown

    # The arithmetic.

    def _round(self, product: int, shift: int) -> int:
        """Return a product over 2^shift, rounded by the number of the event."""
        full = (product << CHANCE_BITS) >> shift
        return (full + self._chance) >> CHANCE_BITS

    def _power(self, x: int, sign: int = 0) -> int:
        """Return 2^x, or −2^x for sign < 0."""
        whole = min(x >> LOG_BITS, RESULT_BITS - 1)
        mantissa = POWERS[(x & ((1 << LOG_BITS) - 1)) >> (LOG_BITS - EXP_INDEX)]
        size = self._round(mantissa << (RESULT_BITS - POWER_BITS), RESULT_BITS - whole)
        return -size if sign < 0 else size

    def _product(self, x: int, by: int, name: str) -> int:
        """Return x·by/2^shift, held within 2^36."""
        m, k = factor(by, self._form.factor_bits)
        full = ((x * m) << CHANCE_BITS) >> (self._form.shifts[name] - k)
        if full >> CHANCE_BITS >= 1 << RESULT_BITS:
            return 1 << RESULT_BITS
        if full >> CHANCE_BITS < -(1 << RESULT_BITS):
            return -(1 << RESULT_BITS)
        return (full + self._chance) >> CHANCE_BITS

    def _gain(self, number: int) -> int:
        """Return the logarithm of the gain of p, v or a."""
        place = ((~self.log_share * GAIN_STEPS) >> LOG_BITS) - 2 * GAIN_STEPS
        return self._gains[number][max(0, min(GAINS - 1, place))]

    # The recursion.

    def tick(
        self, number: int, times: int, places: int, last: int, moved: int, kind: int, down: int, end: int, length: int
    ) -> Row:
        """Return what the ports show of a tick; the place is relative to the position."""
        k, bits = self._k, self._form.time_bits
        self._chance = _HALF
        self.since = min(self.since + (length << bits), k["most_since"])
        self.quiet = min(self.quiet + (length << bits), k["most"])
        velocity, age = self.middle
        self.held = (velocity, self.since + age) if self.phase == TRACKS else (0, 0)
        self._moved = moved << self._form.moved_shift
        self.standstill = not number and self.quiet >= k["max_time"]
        if number:
            self.quiet = last << bits
            return self._event(number, times << bits, places, kind, down)
        return self._silence(end, places, times)

    def _event(self, n: int, times: int, places: int, kind: int, down: int) -> Row:
        k = self._k
        if n == 1:
            tau = times
            raw = places * (k["half"] >> self._form.fine_bits)
            at = raw - self.offsets[kind]
        else:
            rest = range(n & 3)
            off = sum(self.offsets[(kind + j if down else kind - j) & 3] for j in rest)
            log_n = log2(n)
            tau = self._power(log2(times) - log_n)
            left = times - self._product(tau, n, "time")
            total = (places << 13 - self._form.fine_bits) - self._round(off, 6)
            at = raw = self._power(log2(total) + k["log_64"] - log_n, -1 if total < 0 else 1)
        self._count_event()
        if self.phase == REST:
            return self._first(at, raw, tau)
        dt = max(self.since - tau, k["clock"])
        log_dt = log2(dt)
        if self.phase == ONE:
            return self._begin(n, at, raw, tau, dt, log_dt)
        expected = self._expected(dt, log_dt)
        if abs(raw - self.edge) < k["sixteenth"] and abs(expected.p - self.p) < k["quarter"]:
            self.edge -= self._moved
            self.p -= self._moved
            return self._emit(self._ahead())
        self.edge = raw - self._moved
        e = at - expected.p
        self.since = tau
        if n > 1:
            rest_of = total - self._product(expected.p, n, "mean")
            more = self._product(expected.v, abs(left), "place_64")
            rest_of += more if left >= 0 else -more
            e = self._power(log2(rest_of) + k["log_64"] - log_n, -1 if rest_of < 0 else 1)
        if abs(e) >= self.slack + (n << PLACE_BITS):
            self.slips = max(self.slips, 0) + 1
            self.offsets[kind] = max(-k["quarter"], min(self.offsets[kind], k["quarter"]))
            if self.slips >= 3 or log_dt + k["log_4"] - self.log_memory - 1 >= 0:
                return self._begin(n, at, raw, tau, dt, log_dt)
            self.p = at - self._moved
            return self._emit(self._ahead())
        return self._take(e, expected, n, kind)

    def _count_event(self) -> None:
        """Let the number of the event, its bits reversed, decide how results are rounded."""
        self.turn = (self.turn + 1) & ((1 << CHANCE_BITS) - 1)
        self._chance = int(f"{self.turn:0{CHANCE_BITS}b}"[::-1], 2)

    def _expected(self, dt: int, log_dt: int) -> Expected:
        """Return the state at an event that comes `dt` after the one before."""
        k = self._k
        h = self._product(self.a, dt, "half_velocity")
        step = self._power(min(log_dt - self.log_memory, 0) + self.log_memory + self.log_growth)
        if log_dt - self.log_memory + k["log_8192"] < 0 <= self.grows:
            step = 0
        memory = max(min(self.memory + (step if self.grows >= 0 else -step), k["most_memory"]), k["clock"])
        return Expected(self.p + self._product(self.v + h, dt, "place"), self.v + h + h, memory, log_dt)

    def _take(self, e: int, expected: Expected, n: int = 0, kind: int = 0) -> Row:
        """Take an event of `n` counts that is e beyond its expected place."""
        k = self._k
        p, v, memory, log_dt = expected
        log_e = log2(e)
        # A change of the speed leaves 8 events or 45, or 32 reads.
        quarter = self._round(e - self.mean, 2)
        self.mean += quarter
        sudden = abs(e) >= self.alarm
        if sudden:
            self.slow_until, memory = 0, min(memory, self._power(log_dt + k["log_8"]))
        elif 2 * abs(self.mean) >= self.mean_alarm:
            self.slow_until, memory = 0, min(memory, self._power(log_dt + k["log_many"]))
            if self.log_share + k["log_256"] < 0:
                half = self._round(e, 1)
                p, e, log_e = p + half, e - half, log_e + k["log_half"]
                self.mean += -self.sure if self.mean >= 0 else self.sure
        self.memory, self.log_memory = memory, log2(memory)
        # The least squares.
        self.log_share = x = min(log_dt - self.log_memory, k["log_quarter"])
        sign = -1 if e < 0 else 1
        of_v = log_e - log_dt + x + x
        self.v = v + self._power(of_v + self._gain(1), sign)
        self.a += self._power(of_v + x - log_dt + self._gain(2), sign)
        self.p = p - self._moved + self._power(log_e + x + self._gain(0), sign)
        change, self.error = e - self.error, e
        self._show_order()
        row = self._emit(self._ahead())
        if self.slips > 0 and not sudden:
            self.lost = 4 * k["count"]
        self._learn(n, e, change, kind)
        self._ready()
        return row

    def _show_order(self) -> None:
        """Show the same least squares of order one, where the acceleration is not seen."""
        k, x = self._k, self.log_share
        log_at = log2(self.a) + self.log_memory
        long = x + k["log_256"] < 0
        unseen = 2 * (log_at + self.log_memory) - x - self.log_limit - (k["log_9_4"] if long else 0) < 0
        if x + k["log_64"] < 0 and unseen:
            self.shown_v = self.v - self._power(log_at - k["of_slope"], -1 if self.a < 0 else 1)
            self.shown_a, self.velocity_std = 0, k["of_straight"]
        else:
            self.shown_v, self.shown_a, self.velocity_std = self.v, self.a, k["of_curve"]

    def _learn(self, n: int, e: int, change: int, kind: int) -> None:
        """Learn the noise, the lag and the offsets of the edges."""
        k, x = self._k, self.log_share
        self.slips = max(min(self.slips, 0) + k["fade"], k["none"])
        self.noises = min(self.noises + k["noises_one"], k["noises_most"])
        shift = self._shift(min(self.noises, k["noises_offset"]))
        if x + k["log_256"] < 0 and self.trouble < 0:
            change = e + self._round(e, 1)
        self.noise += self._round(min(abs(change) - self.noise, 3 * self.noise), shift)
        self.noise = max(self.noise, k["least_noise"])
        most = k["most"]
        self.v, self.a = max(-most, min(self.v, most)), max(-most, min(self.a, most))
        self._learn_lag(e)
        if n == 1 and x + k["past_4"] < 0:
            size = min(abs(e), k["half"])
            quarter = self._round(size, self._shift(max(self.noises, k["noises_least"])))
            quarter = -quarter if e < 0 else quarter
            self.offsets[kind] += 4 * quarter
            self.offsets = [offset - quarter for offset in self.offsets]

    def _learn_lag(self, e: int) -> None:
        off = e - self.lag
        self.lag += self._power(log2(off) + self.log_share + self._k["log_3_2"], -1 if off < 0 else 1)

    def _shift(self, noises: int) -> int:
        """Return ⌊log2⌋ of a number of events, by which what is learned is shifted."""
        return noises.bit_length() - (self._form.factor_bits - CHANCE_BITS)

    def _ready(self) -> None:
        """Find what the next event takes of this one: growth of the memory, noise."""
        k = self._k
        if self._smooth:
            back = self._power(log2(self.a) + self.log_memory - k["of_slope"], -1 if self.a < 0 else 1)
            velocity = self._product(self.v - back, k["tick"], "shown")
            most = k["most_shown"]
            self.middle = max(-most, min(velocity, most)), self._lead + self._round(self.memory, 1)
        self.log_limit = 2 * log2(self.noise) + k["order"]
        lagging = self.log_share + self.log_limit - k["order_lag"]
        if long := self.log_share + k["log_256"] < 0:
            lagging += k["log_9_4"]
        self._set_alarms(long=long)
        self.grows, self.log_growth = 1, 0
        self.trouble = 2 * log2(self.lag) - lagging
        if self.trouble >= 0:
            self.grows, self.log_growth = -1, k["log_half"]
            if self.trouble - k["log_4"] >= 0:
                self.slow_until = 2 * self.memory
            if self.trouble - 2 * k["log_4"] >= 0:
                self.log_growth = -k["log_half"]
        elif self.memory < self.slow_until:
            self.log_growth = k["log_eighth"]

    def _set_alarms(self, *, long: bool) -> None:
        """Find the noise that errors of the next event are compared with."""
        k, quarter, times = self._k, self._round(self.noise, 2), 5
        self.sure = self.certain = self.noise + 2 * quarter * long
        if not long:
            some = self.log_share + k["log_64"] < 0
            self.certain, times = self.noise + quarter * some, 4 + some
        self.certain = max(self.certain, k["sixteenth"])
        self.alarm, self.mean_alarm = times * self.certain, 3 * self.certain
        self.slack = k["half"] + (2 * self.sure if self.log_share + k["past_8"] >= 0 else 0)

    def _first(self, at: int, raw: int, tau: int) -> Row:
        self.phase, self.since = ONE, tau
        self.p, self.edge = at - self._moved, raw - self._moved
        return self._nothing()

    def _begin(self, n: int, at: int, raw: int, tau: int, dt: int, log_dt: int) -> Row:
        """Take the speed from the event before to this one."""
        k = self._k
        e = at - self.p
        self.phase, self.slips, self.lost = TRACKS, k["none"], 0
        self.v = self.shown_v = self._power(log2(e) + k["of_velocity"] - log_dt, -1 if e < 0 else 1)
        self.p, self.edge = at - self._moved, raw - self._moved
        self.since, self.memory, self.log_memory, self.log_share = tau, dt, log_dt, k["log_quarter"]
        if n > 1:
            self.log_memory -= k["log_64"] + k["log_half"]
            self.memory = self._power(self.log_memory)
        self.a = self.shown_a = self.mean = self.lag = self.error = self.slow_until = 0
        self.velocity_std = k["of_curve"]
        row = self._emit(self._ahead())
        self._ready()
        return row

    def _ahead(self) -> int:
        """Return the velocity at the time when it is shown."""
        return self.shown_v + self._product(self.shown_a, self.since + self._lead, "velocity")

    @property
    def _place(self) -> int:
        """The place at the end of the tick."""
        mean = self.shown_v + self._product(self.shown_a, self.since, "half_velocity")
        return self.p + self._product(mean, self.since, "place")

    def _silence(self, end: int, above: int, below: int) -> Row:
        """Say what the silence of a tick says; the edges about the place are displaced by `above` and `below`."""
        k = self._k
        if self.quiet >= k["forget"]:
            self.phase, self.since, self.p = REST, 0, 0
        if self.phase != TRACKS:
            return self._nothing()
        z, least = self._place, 1
        sign = -1 if z < 0 else 1
        offset = self.offsets[(end - 1 if z < 0 else end) & 3]
        offset -= (below if z < 0 else above) * (k["half"] >> self._form.fine_bits)
        beyond = max(sign * (z + offset), 0) - k["half"]
        z -= sign * max(beyond, 0)
        margin = 3 * self.certain + 2 * self.sure
        if self.slack > k["half"]:
            margin = min(margin, k["half"] + k["quarter"])
        beyond -= margin + self.lost
        velocity = self._ahead()
        if beyond >= 0:
            share = k["log_5_8"] if beyond - k["half"] >= 0 else 0
            bound = k["of_speed"] - log2(self.quiet + self._lead) - share
            velocity = sign * min(sign * velocity, self._power(bound))
            least = self._power(bound + k["of_bound"])
        if self.standstill:
            velocity = self.shown_a = 0
        return self._emit(velocity, z, least)

    def _nothing(self) -> Row:
        """Show no velocity."""
        self.shown_a, self.velocity_std, self.held = 0, self._k["none"], (0, 0)
        return self._emit(0, self.p, 0)

    def _emit(self, velocity: int, place: int | None = None, least: int = 1) -> Row:
        """Return the outputs of an update, with a deviation of at least `least` LSB."""
        k, place = self._k, self._place if place is None else place
        shown = self._product(velocity, k["tick"], "shown")
        more = max(self.trouble + k["log_9_4"], 0) + k["log_8"]
        noise = self._round(max(more + self.log_share, self.slips) + self.log_limit, 1)
        return (
            max(-k["most_shown"], min(shown, k["most_shown"])),
            place,
            min(max(self._power(noise + self.velocity_std - self.log_memory), least), k["most_std"]),
            self._product(self.shown_a, k["slope"], "acceleration"),
            int(self.standstill),
            *(self.held if self._smooth else ()),
        )
