"""The tracking recursion of positions that are read; docs/concepts/track.md has its rules."""

from tachometry.sim.golden.methods.track_recursion import ONE, REST, TRACKS, Recursion, Row, log2
from tachometry.sim.signals.arrays import wrapped
from tachometry.spec.formats.tracking import WIDTH
from tachometry.spec.formats.tracking_sampled import OFFSET_BITS, SampledTracking

_NEVER = 1 << WIDTH  # more than any error


class SampledRecursion(Recursion):
    """Keeps the state as `Recursion` does. Its events are reads, and `end` is the number of ticks since one."""

    def __init__(self, form: SampledTracking, lead: int, *, smooth: bool = False) -> None:
        super().__init__(form, lead, smooth=smooth)
        self._reads, k = form, form.constants
        self.noise, self.slips = k["least_noise"], k["none"]
        self.offsets = [0] * 8
        self.log_limit = 2 * log2(self.noise) + k["order"]
        self._kind = self._fine = 0
        self.far = _NEVER  # error from which a read waits for the next one
        self.more = self._log_dt = 0  # what the lag adds to the place; the logarithm of the time since the last read

    def exchanged(self, number: int, written: int) -> int:
        """Return the lower bits of an offset after a write; `written` is 16 times it, twice its number, and 1, or 0."""
        if written:
            self.offsets[written >> 1 & 7] = written >> 4
        return wrapped(self.offsets[number], OFFSET_BITS)

    def _event(self, n: int, times: int, places: int, kind: int, down: int) -> Row:
        """Take a read, whose place is that of the end of the tick; the shaft was there `times` before."""
        self._count_event()
        tau, self._kind, self._fine = times, kind, places << 13
        at = self._moved - self._error_of_period
        if self.phase == REST:
            return self._first(at, at, tau)
        dt = max(self.since - tau, self._k["clock"])
        self._log_dt = log_dt = log2(dt)
        if self.phase == ONE:
            self.more = 0
            return self._begin(1, at, at, tau, dt, log_dt)
        expected = self._expected(dt, log_dt)
        e = at - expected.p
        if abs(e) >= self.far:
            self.far, self.since, self.p, self.standstill = _NEVER, tau + dt, self.p - self._moved, True
            return self._emit(self._ahead())
        self.since, self.more = tau, 0
        return self._take(e, expected)

    def _show_order(self) -> None:
        """Give half of the lag back, where an acceleration is shown."""
        super()._show_order()
        super()._learn_lag(self.error)
        if self.velocity_std < self._k["of_curve"]:
            return
        log_lag, sign = log2(self.lag) + self.log_share + self._k["log_half"], -1 if self.lag < 0 else 1
        self.shown_v += self._power(log_lag - self._log_dt + self._k["of_velocity"] + self._gain(3), sign)
        self.more = self._round(self.lag, 1) - self._power(log_lag + self._gain(0), sign)

    @property
    def _error_of_period(self) -> int:
        here, ahead = self.offsets[self._kind], self.offsets[self._kind + 1 & 7]
        return here + self._product(ahead - here, self._fine, "mean")

    def _learn(self, n: int, e: int, change: int, kind: int) -> None:
        most = 2 * self.noise
        super()._learn(n, e, change, kind)
        k, seen = self._k, self.log_share + self._k["past_4"] < 0
        if not (self._form.period_bits and seen and self.log_memory - k["of_period"] + log2(self.v) >= 0):
            return
        quarter = self._round(min(abs(e), most), self._shift(max(self.noises, k["noises_least"])))
        quarter = -quarter if e < 0 else quarter
        share = self._product(4 * quarter, self._fine, "mean")
        self.offsets = [offset - quarter * (place % 2 == 0) for place, offset in enumerate(self.offsets)]
        self.offsets[self._kind] += 4 * quarter - share
        self.offsets[self._kind + 1 & 7] += share

    def _learn_lag(self, e: int) -> None:
        """Leave the lag, which was learned before it was shown."""

    @property
    def _place(self) -> int:
        return super()._place + self.more

    def _set_alarms(self, *, long: bool) -> None:
        k, times = self._k, 5 if long else 4
        self.sure = self.noise + 2 * self._round(self.noise, 2) * long
        self.alarm = max(times * self.sure, -k["minus_change"])
        self.mean_alarm = max(3 * self.sure, -k["minus_mean"])
        self.far = max(16 * self.sure, -k["least_far"]) if self._form.waits else _NEVER

    def _silence(self, end: int, above: int, below: int) -> Row:
        """Carry on without a read, `end` ticks after the last one."""
        self.standstill = end >= self._reads.max_ticks
        if self.standstill:
            self.phase, self.since, self.p = REST, 0, 0
        if self.phase != TRACKS:
            return self._nothing()
        if end << self._form.time_bits >= self._k["carried"]:
            self.shown_a = 0
        return self._emit(self._ahead())
