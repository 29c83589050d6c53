// The recursion of track.py, line by line. `Constants` stand before this text. The state, in which tables are,
// belongs to the caller.
enum { COLUMNS = 7 };
static inline int bits_of(int64_t x) { return x ? 64 - __builtin_clzll((uint64_t)x) : 0; }
static inline int64_t sign_of(int64_t x) { return x < 0 ? -1 : 1; }

struct Tables {
  int64_t logs[1 << LOG_INDEX], powers[1 << EXP_INDEX], gains[3 * GAINS];
};

struct Recursion : Tables {
  Constants k;
  int64_t reversed[1 << CHANCE_BITS] = {};
  int64_t phase = 0, turn = 0, noises, p = 0, v = 0, a = 0, shown_v = 0, shown_a = 0, memory = 0, log_memory = 0;
  int64_t slow_until = 0, since = 0, quiet = 0, noise, sure, alarm, error = 0, mean = 0, lag = 0, edge = 0, slips = 0;
  int64_t certain, slack = 0, lost = 0;
  bool standstill = false;
  int64_t log_share, offsets[4] = {0, 0, 0, 0}, grows = 1, log_growth = 0, log_limit, trouble = 0, chance, moved = 0, velocity_std = 0;
  int64_t middle = 0, age = 0, held = 0, held_age = 0;
  int64_t *row = nullptr;

  Recursion(const Constants &k, const Tables &tables) : Tables(tables), k(k) {
    for (int i = 0; i < 1 << CHANCE_BITS; i++)
      for (int bit = 0; bit < CHANCE_BITS; bit++) reversed[i] |= (int64_t)(i >> bit & 1) << (CHANCE_BITS - 1 - bit);
    noises = k.noises_first;
    noise = sure = certain = k.quarter, alarm = 4 * sure;
    log_share = -k.log_4, trouble = -k.log_9_4, log_limit = 2 * log2(noise) + k.order;
  }

  int64_t log2(int64_t x) const {
    int64_t size = std::max<int64_t>(x < 0 ? ~x : x, 1);
    int whole = bits_of(size) - 1;
    return ((int64_t)whole << LOG_BITS) + logs[((size << LOG_INDEX) >> whole) & ((1 << LOG_INDEX) - 1)];
  }
  int64_t round(int64_t product, int64_t shift) const {
    return ((product << CHANCE_BITS >> std::min<int64_t>(shift, 63)) + chance) >> CHANCE_BITS;
  }
  int64_t power(int64_t x, int64_t sign) const {
    int64_t whole = std::min<int64_t>(x >> LOG_BITS, RESULT_BITS - 1);
    int64_t mantissa = powers[(x & ((1 << LOG_BITS) - 1)) >> (LOG_BITS - EXP_INDEX)];
    return sign * round(mantissa << (RESULT_BITS - POWER_BITS), RESULT_BITS - whole);
  }
  int64_t product(int64_t x, int64_t by, int64_t shift) const {
    int64_t exponent = std::max<int64_t>(bits_of(by) - k.factor_bits, -CHANCE_BITS);
    int64_t factor = (by << CHANCE_BITS) >> (exponent + CHANCE_BITS);
    int64_t full = (x * factor << (CHANCE_BITS - DROPPED)) >> (shift - exponent - DROPPED), most = (int64_t)1 << RESULT_BITS;
    if (full >> CHANCE_BITS >= most) return most;
    if (full >> CHANCE_BITS < -most) return -most;
    return (full + chance) >> CHANCE_BITS;
  }
  int64_t gain(int number) const {
    int64_t place = ((~log_share * GAIN_STEPS) >> LOG_BITS) - 2 * GAIN_STEPS;
    return gains[number * GAINS + std::max<int64_t>(0, std::min<int64_t>(GAINS - 1, place))];
  }
  int64_t shift(int64_t n) const { return bits_of(n) - (k.factor_bits - CHANCE_BITS); }
  int64_t ahead() const { return shown_v + product(shown_a, since + k.ahead, k.velocity); }
  int64_t place() const {
    return p + product(shown_v + product(shown_a, since, k.half_velocity), since, k.place);
  }
  void emit(int64_t velocity, int64_t place, int64_t least = 1) {
    int64_t shown = product(velocity, k.tick, k.shown);
    row[0] = std::max(-k.most_shown, std::min(shown, k.most_shown));
    row[1] = place;
    int64_t more = std::max<int64_t>(trouble + k.log_9_4, 0) + k.log_8;
    int64_t deviation = power(round(std::max(more + log_share, slips) + log_limit, 1) + velocity_std - log_memory, 1);
    row[2] = std::min(std::max(deviation, least), k.most_std);
    row[3] = product(shown_a, k.slope, k.acceleration);
    row[4] = standstill, row[5] = held, row[6] = held_age;
  }

  void tick(int64_t number, int64_t times, int64_t places, int64_t last, int64_t moved_, int kind, bool down, int end, int64_t length) {
    int64_t t = k.time_bits;
    chance = 1 << (CHANCE_BITS - 1);
    since = std::min(since + (length << t), k.most_since);
    quiet = std::min(quiet + (length << t), k.most);
    moved = moved_ * k.count;
    held = phase == 2 ? middle : 0, held_age = phase == 2 ? since + age : 0;
    standstill = !number && quiet >= k.max_time;
    if (!number) return silence(end, places, times);
    quiet = last << t;
    event(number, times << t, places, kind, down);
  }
  void event(int64_t n, int64_t times, int64_t places, int kind, bool down) {
    int64_t tau = times, raw = places * (k.half >> k.fine), at = raw - offsets[kind], log_n = 0, left = 0, total = 0;
    if (n > 1) {
      int64_t off = 0;
      for (int j = 0; j < (n & 3); j++) off += offsets[(down ? kind + j : kind - j) & 3];
      log_n = log2(n);
      tau = power(log2(times) - log_n, 1);
      left = times - product(tau, n, k.time);
      total = places * (k.half >> 6 >> k.fine) - round(off, 6);
      at = raw = power(log2(total) + k.log_64 - log_n, sign_of(total));
    }
    turn = (turn + 1) & ((1 << CHANCE_BITS) - 1);
    chance = reversed[turn];
    if (phase == 0) {
      phase = 1, since = tau, p = at - moved, edge = raw - moved;
      return nothing();
    }
    int64_t dt = std::max(since - tau, k.clock), log_dt = log2(dt);
    if (phase == 1) return begin(n, at, raw, tau, dt, log_dt);
    int64_t h = product(a, dt, k.half_velocity), V = v + h + h, way = product(v + h, dt, k.place);
    if (std::abs(raw - edge) < k.sixteenth && std::abs(way) < k.quarter) {
      edge -= moved, p -= moved;
      return emit(ahead(), place());
    }
    int64_t P = p + way, e = at - P;
    edge = raw - moved;
    int64_t step = power(std::min<int64_t>(log_dt - log_memory, 0) + log_memory + log_growth, 1);
    if (log_dt - log_memory + k.log_8192 < 0 && grows >= 0) step = 0;
    int64_t grown = std::max(std::min(memory + (grows >= 0 ? step : -step), k.most_memory), k.clock);
    since = tau;
    if (n > 1) {
      int64_t rest = total - product(P, n, k.mean) + sign_of(left) * product(V, std::abs(left), k.place_64);
      e = power(log2(rest) + k.log_64 - log_n, sign_of(rest));
    }
    int64_t log_e = log2(e);
    if (std::abs(e) >= slack + n * k.count) {
      slips = std::max<int64_t>(slips, 0) + 1;
      offsets[kind] = std::max(-k.quarter, std::min(offsets[kind], k.quarter));
      if (slips >= 3 || log_dt + k.log_4 - log_memory - 1 >= 0) return begin(n, at, raw, tau, dt, log_dt);
      p = at - moved;
      return emit(ahead(), place());
    }
    mean += round(e - mean, 2);
    bool sudden = std::abs(e) >= alarm;
    if (sudden) slow_until = 0, grown = std::min(grown, power(log_dt + k.log_8, 1));
    else if (2 * std::abs(mean) >= 3 * certain) {
      slow_until = 0, grown = std::min(grown, power(log_dt + k.log_many, 1));
      if (log_share + k.log_256 < 0) {
        int64_t half = round(e, 1);
        P += half, e -= half, log_e += k.log_half, mean -= sign_of(mean) * sure;
      }
    }
    memory = grown, log_memory = log2(memory);
    int64_t x = log_share = std::min(log_dt - log_memory, k.log_quarter), of_v = log_e - log_dt + x + x;
    v = V + power(of_v + gain(1), sign_of(e));
    a += power(of_v + x - log_dt + gain(2), sign_of(e));
    p = P - moved + power(log_e + x + gain(0), sign_of(e));
    int64_t change = e - error;
    error = e;
    bool is_long = x + k.log_256 < 0;
    int64_t log_at = log2(a) + log_memory;
    shown_v = v, shown_a = a, velocity_std = k.of_curve;
    if (x + k.log_64 < 0 && 2 * (log_at + log_memory) - x - log_limit - (is_long ? k.log_9_4 : 0) < 0)
      shown_v -= power(log_at - k.of_slope, sign_of(a)), shown_a = 0, velocity_std = k.of_straight;
    emit(ahead(), place());
    // What is learned.
    if (slips > 0 && !sudden) lost = 4 * k.count;
    slips = std::max(std::min<int64_t>(slips, 0) + k.fade, k.none);
    noises = std::min(noises + k.noises_one, k.noises_most);
    if (is_long && trouble < 0) change = e + round(e, 1);
    noise += round(std::min(std::abs(change) - noise, 3 * noise), shift(std::min(noises, k.noises_offset)));
    noise = std::max(noise, k.least_noise);
    v = std::max(-k.most, std::min(v, k.most)), a = std::max(-k.most, std::min(a, k.most));
    int64_t off = e - lag;
    lag += power(log2(off) + x + k.log_3_2, sign_of(off));
    if (n == 1 && x + k.past_4 < 0) {
      int64_t quarter = sign_of(e) * round(std::min(std::abs(e), k.half), shift(std::max(noises, k.noises_least)));
      offsets[kind] += 4 * quarter;
      for (auto &offset : offsets) offset -= quarter;
    }
    ready();
  }
  void ready() {
    int64_t velocity = product(v - power(log2(a) + log_memory - k.of_slope, sign_of(a)), k.tick, k.shown);
    middle = std::max(-k.most_shown, std::min(velocity, k.most_shown)), age = k.ahead + round(memory, 1);
    log_limit = 2 * log2(noise) + k.order;
    sure = noise;
    int64_t lagging = log_share + log_limit - k.order_lag;
    bool is_long = log_share + k.log_256 < 0;
    int64_t quarter = round(noise, 2);
    if (is_long) sure += 2 * quarter, lagging += k.log_9_4;
    bool some = log_share + k.log_64 < 0;
    certain = std::max(sure + (some && !is_long ? quarter : 0), k.sixteenth);
    alarm = (4 + some) * certain;
    slack = k.half + (log_share + k.past_8 >= 0 ? 2 * sure : 0);
    grows = 1, log_growth = 0;
    trouble = 2 * log2(lag) - lagging;
    if (trouble >= 0) {
      grows = -1, log_growth = k.log_half;
      if (trouble - k.log_4 >= 0) slow_until = 2 * memory;
      if (trouble - 2 * k.log_4 >= 0) log_growth = -k.log_half;
    } else if (memory < slow_until) log_growth = k.log_eighth;
  }
  void begin(int64_t n, int64_t at, int64_t raw, int64_t tau, int64_t dt, int64_t log_dt) {
    int64_t e = at - p;
    phase = 2, slips = k.none, lost = 0;
    v = shown_v = power(log2(e) + k.of_velocity - log_dt, sign_of(e));
    p = at - moved, edge = raw - moved;
    since = tau, log_memory = n > 1 ? log_dt - k.log_64 - k.log_half : log_dt, memory = n > 1 ? power(log_memory, 1) : dt, log_share = k.log_quarter;
    a = shown_a = mean = lag = error = slow_until = 0, velocity_std = k.of_curve;
    emit(ahead(), place());
    ready();
  }
  void silence(int end, int64_t above, int64_t below) {
    if (quiet >= k.forget) phase = since = p = 0;
    if (phase != 2) return nothing();
    int64_t least = 1, z = place(), sign = sign_of(z), velocity = ahead();
    int64_t beyond = std::max<int64_t>(sign * (z + offsets[(z < 0 ? end - 1 : end) & 3] - (z < 0 ? below : above) * (k.half >> k.fine)), 0) - k.half;
    if (beyond >= 0) z -= sign * beyond;
    int64_t margin = 3 * certain + 2 * sure;
    if (slack > k.half) margin = std::min(margin, k.half + k.quarter);
    beyond -= margin + lost;
    if (beyond >= 0) {
      int64_t share = beyond - k.half >= 0 ? k.log_5_8 : 0;
      int64_t bound = k.of_speed - log2(quiet + k.ahead) - share;
      velocity = sign * std::min(sign * velocity, power(bound, 1));
      least = power(bound + k.of_bound, 1);
    }
    if (standstill) velocity = shown_a = 0;
    emit(velocity, z, least);
  }
  void nothing() {
    shown_a = held = held_age = 0, velocity_std = k.none;
    emit(0, p, 0);
  }
};

#define CALLED extern "C" __attribute__((visibility("default")))

CALLED int64_t size() { return sizeof(Recursion); }
CALLED void begin(Recursion *state, const Constants *constants, const Tables *tables) {
  new (state) Recursion(*constants, *tables);
}
CALLED void track(Recursion *state, int64_t ticks, const int64_t *windows, int64_t *rows) {
  for (int64_t i = 0; i < ticks; i++) {
    auto of = [&](int column) { return windows[column * ticks + i]; };
    state->row = rows + COLUMNS * i;
    state->tick(of(0), of(1), of(2), of(3), of(4), (int)of(5), of(6) != 0, (int)of(7), of(8));
  }
}
