// The values of CXXRTL's text in as few words as they have bits. With CXXRTL's own header, whose words are arrays of 32
// bits, a core takes four times as long to compile.
#include <stddef.h>
#include <cstdint>
#include <vector>
#ifndef __GLIBCXX__  // whose vector has copy, equal, min and swap; the rest takes a quarter of the time of a small core
#include <algorithm>
#include <iterator>
#endif

// More than 128 bits, which are not multiplied.
template <size_t parts> struct Wide {
  uint64_t part[parts] = {};
  Wide(unsigned __int128 least = 0) {
    part[0] = uint64_t(least);
    part[1] = uint64_t(least >> 64);
  }
  template <size_t others> explicit Wide(const Wide<others> &other) {
    for (size_t k = 0; k < std::min(parts, others); k++) part[k] = other.part[k];
  }
  explicit operator unsigned __int128() const { return (unsigned __int128)part[1] << 64 | part[0]; }
  explicit operator uint64_t() const { return part[0]; }
  explicit operator bool() const { return !(*this == Wide()); }
  template <class Of> Wide by_part(Of of) const {
    Wide result;
    for (size_t k = 0; k < parts; k++) result.part[k] = of(k);
    return result;
  }
  Wide operator~() const { return by_part([&](size_t k) { return ~part[k]; }); }
  Wide operator&(const Wide &other) const { return by_part([&](size_t k) { return part[k] & other.part[k]; }); }
  Wide operator|(const Wide &other) const { return by_part([&](size_t k) { return part[k] | other.part[k]; }); }
  Wide operator^(const Wide &other) const { return by_part([&](size_t k) { return part[k] ^ other.part[k]; }); }
  Wide operator<<(size_t bits) const { return by_part([&](size_t k) { return at(int64_t(64 * k) - int64_t(bits)); }); }
  Wide operator>>(size_t bits) const { return by_part([&](size_t k) { return at(int64_t(64 * k + bits)); }); }
  Wide operator+(const Wide &other) const {
    bool carry = false;
    return by_part([&](size_t k) {
      uint64_t sum = part[k] + other.part[k], more = sum + carry;
      carry = sum < part[k] || more < sum;
      return more;
    });
  }
  Wide operator-(const Wide &other) const { return *this + ~other + Wide(1); }
  bool operator<(const Wide &other) const {
    return std::lexicographical_compare(std::rbegin(part), std::rend(part), std::rbegin(other.part), std::rend(other.part));
  }
  bool operator==(const Wide &other) const { return std::equal(part, part + parts, other.part); }
  bool operator!=(const Wide &other) const { return !(*this == other); }

 private:
  uint64_t of(int64_t k) const { return k >= 0 && k < int64_t(parts) ? part[k] : 0; }
  uint64_t at(int64_t bit) const {  // 64 bits from one on
    int64_t k = bit >> 6, rest = bit & 63;
    return rest ? of(k) >> rest | of(k + 1) << (64 - rest) : of(k);
  }
};

template <size_t bits> auto word_of() {
  if constexpr (bits <= 64) return uint64_t();
  else if constexpr (bits <= 128) return (unsigned __int128)0;
  else return Wide<(bits + 63) / 64>();
}
template <size_t bits> using Word = decltype(word_of<bits>());

// Bits of a value that are assigned to; of several, the first are the most significant.
template <class Value, size_t stop, size_t start> struct Part {
  static constexpr size_t bits = stop - start + 1;
  Value &of;
};
template <class Value, class Whole, size_t stop, size_t start, class... More>
inline void assign(const Value &from, Part<Whole, stop, start> part, More... more) {
  constexpr size_t left = (0 + ... + More::bits);
  using W = typename Whole::W;
  W mask = W(from.template slice<stop - start + left, left>().ones()) << start;
  part.of.word = (part.of.word & ~mask) | W(from.template slice<stop - start + left, left>().word) << start;
  if constexpr (left > 0) assign(from.template slice<left - 1, 0>(), more...);
}

template <size_t bits> struct value {
  using W = Word<bits>;
  W word{};
  static W ones() { return ~W() >> (sizeof(W) * 8 - bits); }
  value() = default;
  value(const value &) = default;
  value &operator=(const value &) & = default;  // a slice is not assigned to
  explicit value(uint32_t least) : word(least) {}
  template <class... More> explicit value(uint32_t least, More... more) {
    size_t at = 0;
    for (uint32_t one : {least, uint32_t(more)...}) word = word | W(one) << (32 * at++);
  }
  static value of(W word) {
    value result;
    result.word = word;
    return result;
  }
  const value &val() const { return *this; }
  void flip(size_t bit) { word = word ^ W(1) << bit; }
  template <class Integer> Integer get() const { return Integer(word); }
  template <class Integer> void set(Integer integer) { word = W(integer) & ones(); }
  explicit operator bool() const { return bool(word); }
  bool is_zero() const { return !bool(word); }
  bool is_neg() const { return bool(word >> (bits - 1)); }
  bool operator==(const value &other) const { return word == other.word; }
  bool operator!=(const value &other) const { return word != other.word; }
  value update(const value &other, const value &mask) const {
    return of((word & ~mask.word) | (other.word & mask.word));
  }
  template <size_t wide> value<wide> zext() const {
    if constexpr (wide < bits) return value<wide>::of(Word<wide>(word) & value<wide>::ones());
    else return value<wide>::of(Word<wide>(word));
  }
  template <size_t wide> value<wide> sext() const {
    if constexpr (wide <= bits) return zext<wide>();
    Word<wide> word = zext<wide>().word;
    return value<wide>::of(is_neg() ? word | (value<wide>::ones() ^ Word<wide>(ones())) : word);
  }
  template <size_t stop, size_t start = stop> value<stop - start + 1> slice() const {
    return value<bits - start>::of(Word<bits - start>(word >> start)).template zext<stop - start + 1>();
  }
  // Bits that are assigned to.
  template <size_t stop, size_t start = stop> Part<value, stop, start> part() { return {*this}; }
  Part<value, bits - 1, 0> part() { return {*this}; }
  template <size_t others> value<bits + others> concat(const value<others> &other) const {
    using Both = Word<bits + others>;
    return value<bits + others>::of(Both(word) << others | Both(other.word));
  }
  template <size_t count> value<count> repeat() const { return value<count>::of(word ? value<count>::ones() : Word<count>()); }
};

template <size_t bits> struct wire {
  value<bits> curr, next;
  wire() = default;
  template <class... Init> explicit wire(Init... init) : curr{init...}, next{init...} {}
  wire(const wire &) = delete;
  wire &operator=(wire &&) = default;
};

#define EACH template <size_t Y, size_t A, size_t B> static inline value<Y>
#define ONE template <size_t Y, size_t A> static inline value<Y>
#define BOTH(name, expression)                                                   \
  EACH name##_uu(const value<A> &a, const value<B> &b) {                         \
    auto x = a.template zext<Y>().word, y = b.template zext<Y>().word;           \
    return value<Y>::of((expression) & value<Y>::ones());                        \
  }                                                                              \
  EACH name##_ss(const value<A> &a, const value<B> &b) {                         \
    auto x = a.template sext<Y>().word, y = b.template sext<Y>().word;           \
    return value<Y>::of((expression) & value<Y>::ones());                        \
  }
BOTH(and, x & y)
BOTH(or, x | y)
BOTH(xor, x ^ y)
BOTH(add, x + y)
BOTH(sub, x - y)
BOTH(mul, x * y)
// Both are extended to a bit more, which makes a comparison of signs one of numbers.
#define COMPARED(name, expression)                                               \
  EACH name##_uu(const value<A> &a, const value<B> &b) {                         \
    constexpr size_t wide = A > B ? A : B;                                       \
    auto x = a.template zext<wide>().word, y = b.template zext<wide>().word;     \
    return value<Y>(uint32_t(expression));                                       \
  }                                                                              \
  EACH name##_ss(const value<A> &a, const value<B> &b) {                         \
    constexpr size_t wide = A > B ? A : B;                                       \
    auto sign = Word<wide>(1) << (wide - 1);                                     \
    auto x = a.template sext<wide>().word ^ sign, y = b.template sext<wide>().word ^ sign; \
    return value<Y>(uint32_t(expression));                                       \
  }
COMPARED(eq, x == y)
COMPARED(ne, x != y)
COMPARED(lt, x < y)
COMPARED(le, !(y < x))
COMPARED(gt, y < x)
COMPARED(ge, !(x < y))

ONE not_u(const value<A> &a) { return value<Y>::of(~a.template zext<Y>().word & value<Y>::ones()); }
ONE neg_u(const value<A> &a) { return sub_uu<Y>(value<1>(), a); }
ONE neg_s(const value<A> &a) { return sub_ss<Y>(value<1>(), a); }
ONE logic_not(const value<A> &a) { return value<Y>(uint32_t(a.is_zero())); }
ONE reduce_or(const value<A> &a) { return value<Y>(uint32_t(!a.is_zero())); }
ONE reduce_bool(const value<A> &a) { return reduce_or<Y>(a); }
ONE reduce_and(const value<A> &a) { return value<Y>(uint32_t(a.word == value<A>::ones())); }
ONE reduce_xor(const value<A> &a) {
  uint64_t odd = 0;
  for (size_t k = 0; k < A; k += 64) odd ^= uint64_t(a.word >> k);
  return value<Y>(uint32_t(__builtin_parityll(odd)));
}
// A number that is shifted by at least its bits is 0.
EACH shl_uu(const value<A> &a, const value<B> &b) {
  auto x = a.template zext<Y>().word;
  return b.word < Y ? value<Y>::of(x << size_t(b.word) & value<Y>::ones()) : value<Y>();
}
EACH shr_uu(const value<A> &a, const value<B> &b) {
  return b.word < A ? value<A>::of(a.word >> size_t(b.word)).template zext<Y>() : value<Y>();
}
EACH shift_uu(const value<A> &a, const value<B> &b) { return shr_uu<Y>(a, b); }

struct memory_index {
  bool valid;
  size_t index;
  template <size_t bits> memory_index(const value<bits> &at, size_t first, size_t depth)
      : valid(at.word >= first && at.word < first + depth), index(at.word - first) {}
};

template <size_t width> struct memory {
  using word = value<width>;
  struct Write { size_t index; word val, mask; };
  struct {
    Write write;
    bool any = false;
    void clear() { any = false; }
    const Write *begin() const { return &write; }
    const Write *end() const { return begin() + any; }
  } write_queue;
  std::vector<word> data;
  explicit memory(size_t depth) : data(depth) {}
  const word &operator[](size_t index) const { return data[index]; }
  void update(size_t index, const word &val, const word &mask, int) {
    write_queue.write = {index, val, mask};
    write_queue.any = bool(mask);
  }
  void commit() {
    for (const auto &write : write_queue) data[write.index] = data[write.index].update(write.val, write.mask);
    write_queue.clear();
  }
};
struct interior {};
struct performer;
#define CXXRTL_ASSERT(within)

