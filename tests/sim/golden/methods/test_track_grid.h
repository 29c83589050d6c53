// Plays constant speeds through the recursion. tracking's C++ text stands before this.
// A row of `clocks` has the counts of a cell; the ticks have `cycles` clocks. Per cell, after `settle` ticks, `found` has
// the greatest error of tracking and that of M/T, which divides the counts between the last counts of two ticks by
// their time, in parts of the speed `rate` (counts a tick); `lsb` is that of the velocity.
CALLED void search(const Constants *constants, const Tables *tables, int64_t cells, int64_t most, const int64_t *clocks,
                   const int64_t *backward, int64_t cycles, int64_t ticks, int64_t settle, double rate, double lsb, double *found) {
  const Recursion begun(*constants, *tables);
  for (int64_t cell = 0; cell < cells; cell++, clocks += most) {
    Recursion state = begun;
    const int64_t way = backward[cell] ? -1 : 1;
    int64_t row[COLUMNS], counts = 0, latest = -1, before = 0;
    double quotient = 0, *worst = found + 2 * cell;
    state.row = row, worst[0] = worst[1] = 0;
    for (int64_t tick = 0; tick < ticks; tick++) {
      const int64_t end = (tick + 1) * cycles - 1, first = counts;
      int64_t times = 0;
      while (counts < most && clocks[counts] <= end) times += end - clocks[counts++];
      const int64_t n = counts - first, last = n ? clocks[counts - 1] : 0;
      if (n) {
        if (latest >= 0) quotient = (double)(counts - before) * cycles / (last - latest);
        latest = last, before = counts;
      }
      const int64_t kind = way > 0 ? counts - 1 : -counts;
      state.tick(n, times, way * n * n, n ? end - last : 0, way * n, kind & 3, way < 0, (way * counts) & 3, cycles);
      if (tick < settle) continue;
      worst[0] = std::max(worst[0], std::abs(way * row[0] * lsb / rate - 1));
      worst[1] = std::max(worst[1], std::abs(quotient / rate - 1));
    }
  }
}
