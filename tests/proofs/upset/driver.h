// Plays a trace, and at some clocks those that follow once more with a flip-flop upset, and collects what is then shown.
// It is compiled behind sim/engines/driver.h and `State`: all flip-flops and memories that can be written, which `save`, `load`
// and `flip` are for.

#include <cstring>

struct Upsets {
  int64_t n_clocks;
  const int64_t *at;  // clock of each change of the pins
  const void *level;  // as the model plays them
  int64_t n_changes;
  const int64_t *clock;  // of each upset, none before another
  const int64_t *bit;
  int64_t n_upsets, length;  // clocks that are played with it
  int64_t *rows;  // number of the upset, clocks since, outputs: where they are others than in the clock before
  int64_t n_rows, capacity;
};

static inline void play(Model &model, const Upsets &job, int64_t &next, int64_t clock) {
  while (next < job.n_changes && job.at[next] <= clock) model.play(job.level, next++);
  model.settle();
}

// How many upsets have been played: fewer if there is no more room.
ENTRY __attribute__((flatten)) int64_t upsets_run(Upsets *job) {
  constexpr int OUTPUTS = N_COLUMNS - 1;
  Model model;
  State before;
  int64_t next = 0, n = 0;
  for (int64_t clock = 0; clock < job->n_clocks && n < job->n_upsets; clock++) {
    for (; n < job->n_upsets && job->clock[n] == clock; n++) {
      if (job->capacity - job->n_rows < job->length) return n;
      int64_t later = next, shown[OUTPUTS];
      save(model, before);
      flip(model, job->bit[n]);
      for (int64_t k = 0; k < job->length; k++) {
        play(model, *job, later, clock + k);
        int64_t *row = job->rows + job->n_rows * (2 + OUTPUTS);
        model.outputs(row + 2);
        if (k == 0 || std::memcmp(row + 2, shown, sizeof shown)) {
          row[0] = n;
          row[1] = k;
          std::memcpy(shown, row + 2, sizeof shown);
          job->n_rows++;
        }
        model.edge();
      }
      load(model, before);
      if (next) model.play(job->level, next - 1);
    }
    play(model, *job, next, clock);
    model.edge();
  }
  return n;
}
