// Plays a trace, and at some clocks those that follow once more with a flip-flop upset, and collects what is then shown.
// It is compiled behind sim/engines/driver.h and `State`: all flip-flops and memories that can be written, which `save`,
// `load`, `same` and `flip` are for.

#include <cstring>

struct Upsets {
  int64_t n_clocks;
  const int64_t *at;  // clock of each change of the pins
  const void *level;  // as the model plays them
  int64_t n_changes;
  const int64_t *clock;  // of each upset
  const int64_t *bit;
  int64_t n_upsets, length;  // clocks that are played with it
  int64_t *rows;  // number of the upset, clocks since, outputs: where they are others than in the clock before
  int64_t n_rows, capacity;
};

constexpr int OUTPUTS = N_COLUMNS - 1;
constexpr int64_t KEPT = 1000;  // clocks from a state of the core without an upset that is kept to the next

struct Row {
  int64_t clock, shown[OUTPUTS];
};

// Plays from a clock on, and keeps rows.
struct Playing {
  const Upsets &job;
  int64_t clock = 0, next = 0;
  Model model{};
  std::vector<Row> rows{};

  // Go to a state that was kept.
  void go(const State &state, int64_t when) {
    load(model, state);
    clock = when;
    next = std::upper_bound(job.at, job.at + job.n_changes, clock) - job.at;
    if (next) model.play(job.level, next - 1);
    rows.clear();
  }

  void one() {
    while (next < job.n_changes && job.at[next] <= clock) model.play(job.level, next++);
    model.settle();
    Row row{clock++};
    model.outputs(row.shown);
    if (rows.empty() || std::memcmp(row.shown, rows.back().shown, sizeof row.shown)) rows.push_back(row);
    model.edge();
  }
};

// How many upsets have been played: fewer if there is no more room.
ENTRY __attribute__((flatten)) int64_t upsets_run(Upsets *job) {
  Playing right{*job}, wrong{*job};
  std::vector<State> kept;
  for (int64_t n = 0; n < job->n_upsets; n++) {
    if (job->capacity - job->n_rows < job->length) return n;
    const int64_t begin = job->clock[n], end = begin + job->length;
    for (; right.clock < end; right.one()) {
      if (right.clock % KEPT) continue;
      kept.emplace_back();
      save(right.model, kept.back());
    }
    wrong.go(kept[begin / KEPT], begin / KEPT * KEPT);
    while (wrong.clock < begin) wrong.one();
    wrong.rows.clear();
    flip(wrong.model, job->bit[n]);
    while (wrong.clock < end && (wrong.clock % KEPT || !same(wrong.model, kept[wrong.clock / KEPT]))) wrong.one();
    // What is as if nothing had been upset stays so.
    auto since = [](int64_t clock, const Row &row) { return clock < row.clock; };
    auto later = std::upper_bound(right.rows.begin(), right.rows.end(), wrong.clock, since) - 1;
    for (int64_t from = wrong.clock; from < end && later != right.rows.end() && later->clock < end; later++)
      wrong.rows.push_back(*later), wrong.rows.back().clock = std::max(from, later->clock);
    for (const Row &row : wrong.rows) {
      int64_t *found = job->rows + job->n_rows++ * (2 + OUTPUTS);
      found[0] = n;
      found[1] = row.clock - begin;
      std::copy(row.shown, row.shown + OUTPUTS, found + 2);
    }
  }
  return job->n_upsets;
}
