// What moves by itself in clocks in which all else stands still, see hdl/arithmetic/idle.py. `clocks` are those for which
// it goes on from this one: ANY if it stands, 0 if it does something else. `move_on` does so many edges at once.

constexpr int64_t ANY = INT64_MAX;

template <size_t width> struct Moves {
  wire<width> &home;
  static constexpr uint64_t mask = ~0ull >> (64 - width);
  bool stands() const { return home.next == home.curr; }
  uint64_t now() const { return home.curr.template get<uint64_t>(); }
  uint64_t next() const { return home.next.template get<uint64_t>(); }
  void set(uint64_t value) {
    home.curr.set(value & mask);
    home.next = home.curr;
  }
};

// A counter by 1 or −1 comes to its stops, all modulo a power of two.
template <size_t width> struct Counts : Moves<width> {
  int64_t step;
  std::initializer_list<int64_t> stops;
  int64_t clocks() const {
    if (this->stands()) return ANY;
    if (this->next() != ((this->now() + step) & this->mask)) return 0;
    int64_t clocks = ANY;
    for (int64_t stop : stops) clocks = std::min(clocks, int64_t((stop - this->now()) * step & this->mask));
    return clocks;
  }
  void move_on(int64_t clocks) {
    if (!this->stands()) this->set(this->now() + step * clocks);
  }
};
template <size_t width> Counts(wire<width> &, int64_t, std::initializer_list<int64_t>) -> Counts<width>;

template <size_t width> struct Adds : Moves<width> {
  int64_t clocks() const { return ANY; }
  void move_on(int64_t clocks) { this->set(this->now() + (this->next() - this->now()) * clocks); }
};
template <size_t width> Adds(wire<width> &) -> Adds<width>;

// A product, a bit of the factor a clock, until one is left.
template <size_t width, size_t factor_width, size_t left_width> struct Multiplies {
  Moves<width> total;
  Moves<factor_width> factor;
  Moves<left_width> left;
  Moves<width> word;
  static int64_t whole(uint64_t value) { return extended(int64_t(value), width, true); }
  uint64_t after(int64_t clocks) const {
    int64_t sum = whole(total.now()), added = whole(word.now());
    for (int64_t k = 0; k < clocks; k++) sum = (sum + (factor.now() >> k & 1 ? added : 0)) >> 1;
    return uint64_t(sum) & total.mask;
  }
  int64_t clocks() const {
    if (left.stands() && factor.stands() && total.stands()) return ANY;
    bool goes = left.now() > 1 && left.next() == left.now() - 1 && factor.next() == factor.now() >> 1;
    return goes && total.next() == after(1) ? int64_t(left.now()) - 1 : 0;
  }
  void move_on(int64_t clocks) {
    if (left.stands()) return;
    total.set(after(clocks));
    factor.set(factor.now() >> clocks);
    left.set(left.now() - clocks);
  }
};
template <size_t width, size_t factor_width, size_t left_width>
Multiplies(wire<width> &, wire<factor_width> &, wire<left_width> &, wire<width> &)
    -> Multiplies<width, factor_width, left_width>;

// States in an order of their own, to the last of them.
struct Order {
  std::vector<uint16_t> states, place;
  Order(std::initializer_list<uint16_t> states) : states(states), place(1 << 16) {
    for (size_t k = 0; k < states.size(); k++) place[this->states[k]] = uint16_t(k);
  }
};
template <size_t width> struct Follows : Moves<width> {
  const Order &order;
  size_t place() const { return order.place[this->now()]; }
  int64_t clocks() const {
    if (this->stands()) return ANY;
    size_t left = order.states.size() - 1 - place();
    return left && order.states[place() + 1] == this->next() ? int64_t(left) : 0;
  }
  void move_on(int64_t clocks) {
    if (!this->stands()) this->set(order.states[place() + size_t(clocks)]);
  }
};
template <size_t width> Follows(wire<width> &, const Order &) -> Follows<width>;

// A division by m: its registers after so many steps but none.
struct Division {
  uint64_t digits, less_one;
  Division(int done, uint64_t m)
      : digits((((1ull << done) - 1) / (2 * m)) + (1ull << done >> 1)),
        less_one((1ull << done) - (2 * digits - (1ull << done) + 1) * m - 1) {}
};
template <size_t width, size_t rest_width, size_t m_width> struct Divides {
  Moves<width> digits;
  Moves<rest_width> less_one;
  Moves<m_width> m;
  int steps;
  bool stands() const { return digits.stands() && less_one.stands(); }
  int done() const { return digits.now() == 0 ? 0 : 64 - __builtin_clzll(digits.now()); }
  int64_t clocks() const {
    if (stands()) return ANY;
    Division one(done() + 1, m.now());
    return digits.next() == one.digits && less_one.next() == (one.less_one & less_one.mask) ? steps - done() : 0;
  }
  void move_on(int64_t clocks) {
    if (stands()) return;
    Division then(done() + int(clocks), m.now());
    digits.set(then.digits);
    less_one.set(then.less_one);
  }
};
template <size_t width, size_t rest_width, size_t m_width>
Divides(wire<width> &, wire<rest_width> &, wire<m_width> &, int) -> Divides<width, rest_width, m_width>;

// Whether a memory is written with other words than it has.
template <class Memory> static inline bool changes(const Memory &memory) {
  for (const auto &write : memory.write_queue)
    if (memory[write.index].update(write.val, write.mask) != memory[write.index]) return true;
  return false;
}
