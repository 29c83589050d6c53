// Properties of the front end: position, windows, pulse numbers, illegal transitions. The p properties speak of the
// core's ports and the latencies of its manifest only. `rst` may come at any time.
// core_* show registers of the core to the lemmas, which make the induction short; prove.py connects them.
module front #(
    parameter DECODING = 4,
    parameter FILTER = 0,
    parameter T = 4,              // tick_cycles
    parameter TICK_LATENCY = 2,
    parameter MAX_COUNT = 4,
    parameter COUNT_WIDTH = 4,
    parameter SUM_WIDTH = 4,      // bits of the sum of a window
    parameter START = 0,          // what it is raised by
    parameter POSITION_WIDTH = 8,
    parameter UPSET = 0           // the phases of the window and of the filter are those of the core, which may have any
) (
    input clk, input rst, input a, input b
);
  localparam W = $clog2(T) + 2, P = POSITION_WIDTH;
  wire tick, decode_error, overflow;
  wire signed [COUNT_WIDTH-1:0] pulse_count;
  wire signed [P-1:0] position;
  tachometer core (
      .clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .pulse_count(pulse_count), .position(position),
      .decode_error(decode_error), .overflow(overflow)
  );
  wire [2:0] core_clocks;
  wire signed [SUM_WIDTH-1:0] core_sum;
  wire signed [SUM_WIDTH:0] core_count = core_sum - START;

  // The conditioned pins: two flip-flops, then a filter that follows when the last FILTER levels all differ from it, and
  // that begins when the last FILTER levels were the same. The first real level is that of the first clock after reset.
  reg [1:0] stage0 = 0, stage1 = 0;
  reg [1:0] clocks = 0;  // since reset, at most 3
  always @(posedge clk) begin
    {stage1, stage0} <= {stage0, {a, b}};
    clocks <= rst ? 0 : clocks == 3 ? 3 : clocks + 1;
  end
  wire [1:0] level;
  wire ready;
  generate
    if (FILTER == 0) begin
      assign level = stage1;
      assign ready = clocks >= 3;
    end else begin : glitch
      reg [1:0] filtered = 0;
      reg [2*FILTER-1:0] recent = 0;  // the levels before stage1
      wire [2*FILTER+1:0] levels = {recent, stage1};
      wire [$clog2(FILTER < 2 ? 2 : FILTER)-1:0] core_held_a, core_held_b;
      wire core_a, core_b, core_known_a, core_known_b;
      reg [1:0] known = 0;
      reg begun = 0;
      reg [7:0] same_a = 0, same_b = 0;  // real levels before this one that were the same, at most FILTER
      wire [1:0] is_known = UPSET ? {core_known_a, core_known_b} : known;
      wire [7:0] now_a = clocks < 2 ? 0 : same_a == 0 || stage1[1] != recent[1] ? 1 : same_a < FILTER ? same_a + 1 : FILTER;
      wire [7:0] now_b = clocks < 2 ? 0 : same_b == 0 || stage1[0] != recent[0] ? 1 : same_b < FILTER ? same_b + 1 : FILTER;
      wire [1:0] passed = UPSET ? {core_a, core_b} : filtered;
      reg [1:0] held, run;
      reg [7:0] held_a, held_b;  // for how many clocks before this one the level has differed
      integer k;
      always @* begin
        held = 2'b11;
        run = is_known;
        {held_a, held_b} = 0;
        for (k = 0; k < FILTER; k = k + 1) begin
          held = held & (levels[2*k+:2] ^ passed);
          run = run & (recent[2*k+:2] ^ passed);
          held_a = held_a + run[1];
          held_b = held_b + run[0];
        end
        lemma_held: assert ((is_known[1] ? held_a : same_a) == core_held_a && (is_known[0] ? held_b : same_b) == core_held_b
            && (!is_known[1] || filtered[1] == core_a) && (!is_known[0] || filtered[0] == core_b));
        lemma_known: assert (known == {core_known_a, core_known_b} && (known[1] || same_a < FILTER)
            && (known[0] || same_b < FILTER));
        lemma_same: assert ((known[1] || same_a == 0 || core_a == recent[1]) && (known[0] || same_b == 0 || core_b == recent[0])
            && (clocks >= 2 || {same_a, same_b, known} == 0) && (clocks < 3 || (same_a >= 1 && same_b >= 1)));
      end
      always @(posedge clk) begin
        recent <= levels;
        filtered <= rst ? 0 : (is_known & (passed ^ held)) | (~is_known & stage1);
        {same_a, same_b} <= rst ? 0 : {now_a, now_b};
        known <= rst ? 0 : is_known | {now_a == FILTER, now_b == FILTER};
        begun <= !rst && is_known == 2'b11;
      end
      assign level = filtered;
      assign ready = begun;
    end
  endgenerate

  // Steps by the Gray phase 00, 10, 11, 01 = 0, 1, 2, 3.
  wire [1:0] phase = {level[0], level[1] ^ level[0]};
  reg [1:0] past = 0, first = 0;
  wire [1:0] turned = phase - past;
  wire illegal = ready && turned == 2;
  wire counted = DECODING == 4 || ((phase[1] ^ phase[0]) != (past[1] ^ past[0]) && (DECODING == 2 || !level[0]));
  wire signed [2:0] quarter = !ready ? 0 : turned == 1 ? 1 : turned == 3 ? -1 : 0;
  wire signed [2:0] step = counted ? quarter : 0;

  // Windows of T clocks from reset on, and all counts by x4, of which x2 and x1 are a half and a quarter.
  reg [$clog2(T):0] clock = 0;
  wire [$clog2(T):0] elapsing;
  wire last = elapsing == T - 1;
  reg signed [W-1:0] open = 0, sum = 0;
  reg signed [P+1:0] quarters = 0;
  reg skipped = 0, wrong = 0, overflown = 0;  // illegal transitions: odd number of them, any of them
  reg signed [P-1:0] total = 0, position_before = 0;
  wire signed [P-1:0] shown = tick ? total + pulse_count : total;
  always @(posedge clk) begin
    past <= rst ? 0 : phase;
    first <= rst ? 0 : ready ? first : phase;
    clock <= rst || last ? 0 : elapsing + 1;
    open <= rst || last ? 0 : open + step;
    sum <= rst ? 0 : open + step;
    quarters <= rst ? 0 : ready ? quarters + quarter : $signed({1'b0, phase});
    skipped <= rst ? 0 : skipped ^ illegal;
    wrong <= rst ? 0 : wrong | illegal;
    overflown <= rst ? 0 : overflown | overflow;
    total <= rst ? 0 : shown;
    position_before <= rst ? 0 : position;
  end

  // As late as the core shows them; registers are one clock late already.
  wire tick_, skipped_, wrong_, illegal_, ready_;
  wire signed [W-1:0] open_, sum_;
  wire [P+1:0] quarters_;
  wire [1:0] phase_, first_;
  delay #(3, TICK_LATENCY) delays (clk, rst, {last, illegal, ready}, {tick_, illegal_, ready_});
  delay #(P + 8 + 2 * W, TICK_LATENCY - 1) delayed_registers (
      clk, rst, {open, sum, quarters, past, first, skipped, wrong},
      {open_, sum_, quarters_, phase_, first_, skipped_, wrong_}
  );
  // x4 counts from the first phase; x2 and x1 count where that passes a multiple of 2 and 4.
  localparam SHIFT = DECODING == 4 ? 0 : DECODING == 2 ? 1 : 2;
  localparam OFFSET = DECODING == 4 ? 0 : DECODING == 2 ? 1 : 3;
  wire [P+1:0] now = quarters_ + OFFSET, before = first_ + OFFSET;
  wire [P-1:0] angle = (now >> SHIFT) - (before >> SHIFT);
  wire signed [W-1:0] saturated = sum_ > MAX_COUNT ? MAX_COUNT : sum_ < -MAX_COUNT ? -MAX_COUNT : sum_;

  // Lemmas: what the induction needs to know of the state.
  wire signed [W:0] elapsed = $signed({1'b0, clock});
  generate
    if (T > 1) begin : window
      wire signed [$clog2(T - 1):0] core_left;
      wire signed [$clog2(T)+1:0] shown = T - 2 - core_left;
      assign elapsing = UPSET ? $unsigned(shown) : clock;
      always @* lemma_window: assert (core_left == T - 2 - elapsed);
    end else assign elapsing = clock;
  endgenerate
  // Where m_e saturates, the step comes to its sum a clock later.
  wire signed [W-1:0] sum_of_core = clock == 0 ? sum : open;
  reg signed [W-1:0] sum_before = 0;
  always @(posedge clk) sum_before <= rst ? 0 : sum_of_core;
  wire [2:0] thermometer = (1 << clocks) - 1;
  always @* begin
    lemma_clocks: assert (core_clocks == thermometer);
    lemma_clock: assert (clock < T);
    lemma_open: assert (open <= elapsed && -open <= elapsed);
    lemma_count: assert (core_count == (TICK_LATENCY > 2 ? sum_before : sum_of_core));
    lemma_quarters: assert (quarters[1:0] == past - {skipped, 1'b0});
    lemma_wrong: assert (wrong || !skipped);
  end
  always @* begin
    if (DECODING == 4) p1_phase: assert (position[1:0] == phase_ - first_ - {skipped_, 1'b0});
    p1_angle: assert (wrong_ || position == $signed(angle));
    p2_tick: assert (!tick || overflown || overflow || position == shown);
    p2_open: assert (overflown || overflow || position == $signed(shown + open_));
    p3_tick: assert (tick == tick_);
    p3_count: assert (!tick || pulse_count == saturated);
    p3_overflow: assert (!tick || overflow == (sum_ != saturated));
    p6_error: assert (decode_error == illegal);
    p6_uncounted: assert (!illegal_ || position == position_before);
    p6_quiet: assert (ready_ || (position == 0 && (ready || !decode_error)));
  end
endmodule
