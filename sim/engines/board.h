// A demo board whose UART carries bytes. It is compiled behind a `struct Model`, which the engine writes: `pins` sets
// the inputs, the highest of which is the line to the core, `strobe` is the line from it.

#if defined(_WIN32)
#define ENTRY extern "C" __declspec(dllexport)
#else
#define ENTRY extern "C" __attribute__((visibility("default")))
#endif

constexpr int BITS = 10;  // of a byte, with start and stop bit

struct Board {
  Model model;
  uint8_t level = 1 << RX;  // of the inputs
  // The line to the core: the bits that are left of a byte, the lowest first, and clocks that are left of this one.
  uint32_t sending = 0;
  int to_send = 0, send_clocks = 0;
  // The line from the core: bits that are missing of a byte, and clocks to the next sample.
  uint32_t received = 0;
  int to_receive = 0, receive_clocks = 0;
};

// Bytes go in, and bytes come out; both are counted. Ends early when there is no room for another byte.
struct Transfer {
  int64_t clocks;  // to be run; afterwards those that were not
  const uint8_t *in;
  int64_t n_in, taken;
  uint8_t *out;
  int64_t n_out, capacity;
  int64_t lines;  // levels of the other inputs
  int64_t broken;  // bytes without a stop bit, which are dropped
};

ENTRY void *board_new() { return new Board; }
ENTRY void board_delete(void *board) { delete static_cast<Board *>(board); }

ENTRY __attribute__((flatten)) void board_run(void *home, Transfer *transfer) {
  Board &board = *static_cast<Board *>(home);
  Working working(board.model);
  Model &model = working.model;
  while (transfer->clocks > 0 && transfer->n_out < transfer->capacity) {
    if (board.send_clocks == 0) {
      if (board.to_send == 0 && transfer->taken < transfer->n_in) {
        board.sending = uint32_t(transfer->in[transfer->taken++]) << 1 | 1u << (BITS - 1);
        board.to_send = BITS;
      }
      uint32_t bit = 1;
      if (board.to_send > 0) {
        bit = board.sending & 1;
        board.sending >>= 1;
        board.to_send--;
        board.send_clocks = BIT_CYCLES;
      }
      board.level = uint8_t(transfer->lines | int64_t(bit) << RX);
    }
    model.pins(board.level);
    // Nothing changes at the inputs in so many clocks; an idle line is looked at again soon.
    int64_t clocks = board.send_clocks ? board.send_clocks : BIT_CYCLES;
    if (clocks > transfer->clocks) clocks = transfer->clocks;
    transfer->clocks -= clocks;
    if (board.send_clocks) board.send_clocks -= int(clocks);
    for (; clocks > 0; clocks--) {
      model.settle();
      bool line = model.strobe();
      model.edge();
      if (board.to_receive == 0) {
        if (!line) {
          board.to_receive = BITS;
          board.receive_clocks = BIT_CYCLES / 2;
        }
      } else if (--board.receive_clocks == 0) {
        board.received = board.received >> 1 | uint32_t(line) << (BITS - 1);
        board.receive_clocks = BIT_CYCLES;
        if (--board.to_receive == 0) {
          if (line) transfer->out[transfer->n_out++] = uint8_t(board.received >> 1);
          else transfer->broken++;
        }
      }
    }
  }
}
