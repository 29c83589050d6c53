// The clock loop of a compiled core: plays pin changes, collects a row in every clock with a strobe. It is compiled
// behind a `struct Model`, which the engine writes: `play` sets the inputs, `settle` lets everything follow them,
// `edge` is the rising clock edge. Between the two, values are those that a flip-flop would sample. `idle` are clocks in
// which nothing changes but counters up to their ends, from this one on, and `move_on` does so many edges at once.

constexpr int64_t ROOM = 1024;  // rows

struct Job {
  int64_t clock, end;  // clocks done, and to be done
  const int64_t *at;  // clock of each change
  const void *level;  // as the model plays them
  int64_t n_changes, next;
  int64_t *rows;  // clock and outputs
  int64_t n_rows, capacity;
  int64_t *shown;  // clock and shown words, where one has changed
  int64_t n_shown, shown_capacity;
  int64_t shown_from, shown_to;  // clocks
  int64_t every_clock;  // none is skipped
  int64_t skipped;  // clocks
  uint32_t last[N_SHOWN + 1];  // words shown last
};

template <class Integer>
static inline int64_t extended(Integer raw, int width, bool is_signed) {
  return is_signed ? int64_t(uint64_t(raw) << (64 - width)) >> (64 - width) : int64_t(raw);
}

static inline void show(const Model &model, Job &job, int64_t clock) {
  uint32_t words[N_SHOWN + 1];
  model.shown(words);
  bool changed = clock == job.shown_from;
  for (int k = 0; k < N_SHOWN; k++) changed |= words[k] != job.last[k];
  if (!changed) return;
  int64_t *row = job.shown + job.n_shown++ * (1 + N_SHOWN);
  *row++ = clock;
  for (int k = 0; k < N_SHOWN; k++) row[k] = job.last[k] = words[k];
}

#if defined(_WIN32)
#define ENTRY extern "C" __declspec(dllexport)
#else
#define ENTRY extern "C" __attribute__((visibility("default")))
#endif

ENTRY void *tachometer_new() { return new Model; }
ENTRY void tachometer_delete(void *model) { delete static_cast<Model *>(model); }

// Goes on to `end`, or to a clock for which there may be no more room. Room is asked for between clocks only: a clock
// that can be left half done would keep all that it has worked out alive, and cost a third of the speed.
ENTRY __attribute__((flatten)) void tachometer_run(void *home, Job *job) {
  Working working(*static_cast<Model *>(home));
  Model &model = working.model;
  int64_t clock = job->clock;
  while (clock < job->end) {
    int64_t room = job->capacity - job->n_rows;
    if (N_SHOWN && job->shown_capacity - job->n_shown < room) room = job->shown_capacity - job->n_shown;
    if (room < ROOM) break;
    int64_t until = job->end - clock < room ? job->end : clock + room;
    if (job->next < job->n_changes && job->at[job->next] == clock) model.play(job->level, job->next++);
    if (job->next < job->n_changes && job->at[job->next] < until) until = job->at[job->next];
    for (; clock < until; clock++) {
      model.settle();
      if (N_SHOWN && clock >= job->shown_from && clock < job->shown_to) show(model, *job, clock);
      if (model.strobe()) {
        int64_t *row = job->rows + job->n_rows++ * N_COLUMNS;
        *row = clock;
        model.outputs(row + 1);
      }
      int64_t idle = job->every_clock ? 0 : model.idle();
      if (idle > until - clock) idle = until - clock;
      idle -= idle % Model::ROUND;
      if (idle > 1) {
        model.move_on(idle);
        clock += idle - 1;
        job->skipped += idle - 1;
      } else {
        model.edge();
      }
    }
  }
  job->clock = clock;
}
