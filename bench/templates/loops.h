#define LOOP ENTRY __attribute__((flatten))
#define ADD if (model.strobe()) { n++; model.outputs(row); for (int64_t value : row) sum += value; }
#define CLOCKS(...) int64_t n = 0, next = 0, sum = 0, row[N_COLUMNS - 1]; \
  for (int64_t clock = 0; clock < n_clocks; clock++) { \
    if (next < n_changes && at[next] == clock) model.pins(level[next++]); __VA_ARGS__ } return n + (sum << 32);
#define ARGUMENTS const int64_t *at, const uint8_t *level, int64_t n_changes, int64_t n_clocks
LOOP int64_t twice(ARGUMENTS) {
  std::unique_ptr<Model> home(new Model);
  Model &model = *home;
  CLOCKS(model.top.p_clk.set<bool>(false); model.top.step(); ADD
         model.top.p_clk.set<bool>(true); model.top.step();)
}
LOOP int64_t once(ARGUMENTS) {
  std::unique_ptr<Model> home(new Model);
  Model &model = *home;
  CLOCKS(model.settle(); ADD model.top.p_top::commit();)
}
LOOP int64_t copied(ARGUMENTS) {
  std::unique_ptr<Model> home(new Model);
  Model &model = *home;
  CLOCKS(model.settle(); ADD model.edge();)
}
LOOP int64_t bare(ARGUMENTS) {
  Model model;
  CLOCKS(model.settle(); ADD model.edge();)
}
