"""The tracking recursion of positions that are read; docs/concepts/track.md has its rules."""

from tachometry.sim.golden.methods.track_recursion import ONE, REST, TRACKS, Recursion, Row, log2
from tachometry.spec.formats.tracking_sampled import SampledTracking


class SampledRecursion(Recursion):
    """Keeps the state as `Recursion` does. Its events are reads, and `end` is the number of ticks since one."""

    def __init__(self, form: SampledTracking, lead: int, *, smooth: bool = False) -> None:
        super().__init__(form, lead, smooth=smooth)
        self._reads, k = form, form.constants
        self.noise, self.slips = k["least_noise"], k["none"]
        self.log_limit = 2 * log2(self.noise) + k["order"]
        self.more = self._log_dt = 0  # what the lag adds to the place; the logarithm of the time since the last read

    def _event(self, n: int, times: int, places: int, kind: int, down: int) -> Row:
        """Take a read, whose place is that of the end of the tick; the shaft was there `times` before."""
        self._count_event()
        at, tau = self._moved, times
        if self.phase == REST:
            return self._first(at, at, tau)
        dt = max(self.since - tau, self._k["clock"])
        self._log_dt = log_dt = log2(dt)
        self.more = 0
        if self.phase == ONE:
            return self._begin(1, at, at, tau, dt, log_dt)
        expected = self._expected(dt, log_dt)
        self.since = tau
        return self._take(at - expected.p, expected)

    def _show_order(self) -> None:
        """Give half of the lag back, where an acceleration is shown."""
        super()._show_order()
        super()._learn_lag(self.error)
        if self.velocity_std < self._k["of_curve"]:
            return
        log_lag, sign = log2(self.lag) + self.log_share + self._k["log_half"], -1 if self.lag < 0 else 1
        self.shown_v += self._power(log_lag - self._log_dt + self._k["of_velocity"] + self._gain(3), sign)
        self.more = self._round(self.lag, 1) - self._power(log_lag + self._gain(0), sign)

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
