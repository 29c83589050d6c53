// Property of the carried reciprocal, wherever the interval accumulator leads it: Q and R are quotient and remainder of
// C and the m_s of the last tick. core_* show signals of the core; prove.py connects them.
module reciprocal #(
    parameter MAX_TICKS = 16,
    parameter INTERVAL_WIDTH = 5,
    parameter C = 8,
    parameter CARRIED = 4  // entries of the table; beyond it, Q and R are carried
) (
    input clk, input rst, input a, input b
);
  localparam I = INTERVAL_WIDTH, KEPT = MAX_TICKS / 2;
  wire tick;
  tachometer core (.clk(clk), .rst(rst), .a(a), .b(b), .tick(tick));
  wire [I-1:0] core_m_s, core_r;
  wire [$clog2(C):0] core_q;
  localparam Q = $clog2(C / CARRIED + 1);
  wire signed [(I > Q ? I : Q):0] core_less;
  wire [Q-1:0] core_carried_q;
  wire core_longest, core_carried;

  reg [I-1:0] m = 0;  // 0 before the first tick
  always @(posedge clk) m <= rst ? 0 : tick ? core_m_s : m;
  wire [I+$clog2(C):0] product = core_q * m;

  always @* begin
    lemma_longest: assert (core_longest == (core_m_s == MAX_TICKS));
    lemma_m_s: assert (core_m_s >= 1 && core_m_s <= MAX_TICKS);
    lemma_next: assert (core_m_s == 1 || (m != 0 && core_m_s == (m == MAX_TICKS ? KEPT : m) + 1));
    lemma_less: assert (!core_carried || core_less == $signed({1'b0, core_r}) - $signed({1'b0, core_q}));
    // What the last of the table leaves there.
    lemma_ready: assert (m == 0 || m >= CARRIED || (core_less == C % CARRIED && core_carried_q == C / CARRIED));
    lemma_carried: assert (core_carried == (m >= CARRIED));
    p5_reciprocal: assert (m == 0 || (core_r < m && product + core_r == C));
  end
endmodule
