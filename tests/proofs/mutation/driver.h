// All mutants of a group beside the core without any, clock by clock; one that was killed goes on no further. Behind
// CXXRTL's text and functions of the ports: `pins` sets the inputs from words, `outputs` writes a number for each
// output, `strobes` says whether one of them that strobes is high.

#define ENTRY extern "C" __attribute__((visibility("default")))

struct Job {
  int64_t n_clocks;
  const uint64_t *pins;  // of each clock, in N_WORDS words; the lowest bit is the reset
  int64_t n_mutants;  // their selectors are 1 … n_mutants
  int64_t *killed;  // clock in which an output differed, or -1, as at first
  int64_t *rows;  // clock and outputs of the core without a mutant, in every clock with a strobe
  int64_t n_rows, capacity;
};

static void settle(Top &top) {
  top.p_clk = value<1>{0u};
  for (int k = 0; k < 20; k++) {
    bool once = top.eval();
    if (!top.commit() || once) break;
  }
}

static void edge(Top &top) {
  top.p_clk = value<1>{1u};
  top.eval();
  top.commit();
  top.p_clk = value<1>{0u};
  top.commit();
}

ENTRY void mutation_run(Job *job) {
  std::vector<std::unique_ptr<Top>> tops;
  std::vector<int> alive;
  for (int k = 0; k <= job->n_mutants; k++) {
    tops.emplace_back(new Top);
    select(*tops[k], k);
    if (k) alive.push_back(k);
  }
  for (int64_t clock = 0; clock < job->n_clocks; clock++) {
    int64_t right[N_OUTPUTS], wrong[N_OUTPUTS];
    Top &core = *tops[0];
    pins(core, job->pins + clock * N_WORDS);
    settle(core);
    outputs(core, right);
    bool strobe = strobes(core);
    if (strobe && job->n_rows < job->capacity) {
      int64_t *row = job->rows + job->n_rows++ * (1 + N_OUTPUTS);
      *row++ = clock;
      for (int k = 0; k < N_OUTPUTS; k++) row[k] = right[k];
    }
    edge(core);
    size_t left = 0;
    for (int number : alive) {
      Top &top = *tops[number];
      pins(top, job->pins + clock * N_WORDS);
      settle(top);
      outputs(top, wrong);
      if (memcmp(right, wrong, sizeof right)) {
        job->killed[number - 1] = clock;
        tops[number].reset();
        continue;
      }
      edge(top);
      alive[left++] = number;
    }
    alive.resize(left);
  }
}
