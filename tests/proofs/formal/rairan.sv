// Properties of the method of Rairan: from steps to updates. The reference is the list in docs/concepts/rairan.md, with a count
// of all counts in dt, and Nep1 and Ndt1 themselves. `rst` may come at any time.
// core_* show signals of the core to the lemmas, and its steps to the reference; prove.py connects them.
module rairan #(
    parameter T = 3,              // tick_cycles
    parameter MAX_TICKS = 4,
    parameter MAX_COUNT = 2,
    parameter COUNT_WIDTH = 3,
    parameter VELOCITY_WIDTH = 7,
    parameter FRAC_BITS = 4,
    parameter UPSET = 0           // the phase of dt and the direction are those of the core, which may have any
) (
    input clk, input rst, input a, input b
);
  localparam V = VELOCITY_WIDTH, W = 8;
  wire tick, velocity_valid, forced, standstill, overflow;
  wire signed [V-1:0] velocity;
  wire signed [COUNT_WIDTH-1:0] pulse_count;
  wire [$clog2(MAX_COUNT+1)-1:0] n_ep1;
  wire [$clog2(MAX_TICKS+1)-1:0] n_dt1;
  tachometer core (
      .clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .pulse_count(pulse_count), .velocity(velocity), .velocity_valid(velocity_valid),
      .forced(forced), .standstill(standstill), .overflow(overflow), .n_ep1(n_ep1), .n_dt1(n_dt1)
  );
  wire signed [1:0] core_step;
  wire signed [$clog2(T):0] core_left;
  wire signed [$clog2(MAX_COUNT+2):0] core_sum;
  wire core_outside;
  wire [$clog2(MAX_COUNT<3?2:MAX_COUNT)-1:0] core_more;
  wire [$clog2(MAX_TICKS+1)-1:0] core_dt;
  wire [$clog2((MAX_TICKS>MAX_COUNT?MAX_TICKS:MAX_COUNT)+1)-1:0] core_n;
  wire signed [$clog2(MAX_TICKS - 1):0] core_empty;
  wire core_rests, core_silent, core_forced, core_at_rest, core_any, core_high, core_backward, core_moved, core_late, core_in_step, core_rest, core_beyond;

  wire still, rested;
  wire [31:0] quiet;
  standstill #(MAX_TICKS, COUNT_WIDTH) standing (clk, rst, tick, pulse_count, still, rested, quiet);

  reg [W-1:0] clock = 0, c_ep = 0, c_dt = 0, n_ep = 0, n_dt = 1, idle = 0;
  reg moved = 0, back = 0, in_step = 0;
  reg first = 1;                  // the clock after the reset, in which no step can have come
  wire count = core_step != 0, backward = core_step < 0;
  wire has_moved = UPSET ? core_moved : moved, was_back = UPSET ? core_backward : back;
  wire signed [W:0] shown_clock = T - 2 - core_left;
  wire [W-1:0] elapsing = UPSET ? $unsigned(shown_clock) : clock - first;
  wire turns = count && has_moved && backward != was_back;
  wire late = count && !turns && (c_dt != 0 || !has_moved), fresh = !has_moved || c_dt == MAX_TICKS;
  wire ends = !turns && !late && elapsing == T - 1;
  wire [W-1:0] held = c_ep > MAX_COUNT ? MAX_COUNT : c_ep;
  wire [W-1:0] waited = in_step ? c_dt + 1 : c_dt;
  reg update, alone, rests, was_alone = 0, was_rest = 0;
  reg [W-1:0] ep, dt;
  always @* begin
    {update, alone, rests} = {1'b0, was_alone, was_rest};
    ep = n_ep;
    dt = n_dt;
    if (turns) {update, alone, rests, ep, dt} = {3'b100, {W{1'b0}}, {{W-1{1'b0}}, 1'b1}};
    else if (late) begin
      if (!fresh && (c_dt >= 2 || n_ep < 2)) begin
        {update, alone, rests} = 3'b100;
        ep = 1;
        dt = c_dt;
      end
    end else if (ends) begin
      if (held >= 2) begin
        {update, alone, rests} = 3'b100;
        ep = held;
        dt = 1;
      end else if (count || (held == 1 && n_ep >= 2)) begin
        {update, alone, rests} = 3'b100;
        ep = 1;
        dt = 1;
      end else if (c_dt >= MAX_TICKS - 1) begin
        {update, alone, rests} = {c_dt != MAX_TICKS, 2'b11};
        ep = 0;
        dt = 1;
      end else if (waited * n_ep > n_dt) begin
        {update, alone, rests} = 3'b110;
        ep = 1;
        dt = waited;
      end
    end
  end
  always @(posedge clk)
    if (rst) begin
      {clock, c_ep, c_dt, n_ep, idle, moved, back, in_step, was_alone, was_rest} <= 0;
      n_dt <= 1;
      first <= 1;
    end else begin
      first <= 0;
      clock <= turns || late || ends ? 0 : elapsing + 1;
      c_ep <= turns || late || (ends && count) ? 1 : ends ? 0 : c_ep + count;
      c_dt <= count ? 0 : !ends ? c_dt : c_dt < MAX_TICKS ? c_dt + 1 : MAX_TICKS;
      {moved, back} <= count ? {1'b1, backward} : {has_moved, was_back};
      if (count) in_step <= turns || late || ends;
      n_ep <= ep;
      n_dt <= dt;
      {was_alone, was_rest} <= {alone, rests};
      idle <= count || first ? 0 : idle < MAX_TICKS * T ? idle + 1 : MAX_TICKS * T;
    end

  // As late as the core shows them.
  wire update_, alone_, back_, tick_, more_;
  wire [W-1:0] ep_, idle_, n_ep_;
  wire [W-1:0] less_, dt_ = less_ + 1'd1;  // after reset Ndt1 is 1
  delay #(2 + 2 * W, 4) delays (clk, rst, {update, alone, ep, dt - 1'd1}, {update_, alone_, ep_, less_});
  delay #(2 * W + 1, 3) delayed_registers (clk, rst, {back, idle, n_ep}, {back_, idle_, n_ep_});
  delay #(2, 2) delayed_ends (clk, rst, {ends, ends && c_ep > MAX_COUNT}, {tick_, more_});

  // n3 = 2/q or (q - 1/q)/2, times 2^f, and 1/2, rounded down: below it 2q raw, and 2q (raw + 1) above.
  wire signed [23:0] q = ep_ >= 2 ? 2 * ep_ - 1 : 2 * dt_ + 1;
  wire signed [23:0] wanted = (ep_ >= 2 ? (q * q - 1) << FRAC_BITS : 4 << FRAC_BITS) + q;
  wire signed [23:0] magnitude = back_ ? -velocity : velocity;
  wire signed [23:0] have = 2 * q * magnitude;

  // Lemmas: what the induction needs to know of the state.
  wire signed [W:0] elapsed = $signed({1'b0, clock});
  always @* begin
    lemma_left: assert (core_left == T - 2 - elapsed + $signed({1'b0, first}));
    lemma_first: assert (!first || (clock == 0 && core_step == 0));
    lemma_clock: assert (clock < T && c_ep <= clock + 1);
    lemma_count: assert (core_any == (c_ep != 0) && core_more == (held == 0 ? 0 : held - 1));
    lemma_dt: assert (core_dt == c_dt && core_late == (c_dt != 0 || !moved) && core_rest == (c_dt == MAX_TICKS));
    lemma_moved: assert (moved || (c_ep == 0 && n_ep == 0));
    lemma_in_dt: assert (c_dt == 0 || c_ep == 0);
    lemma_flags: assert (core_moved == moved && core_backward == back
        && (c_dt == MAX_TICKS || core_in_step == in_step));
    lemma_beyond: assert (core_beyond == (c_ep > MAX_COUNT));
    lemma_n: assert (core_high == (n_ep >= 2) && core_n == (n_ep >= 2 ? n_ep - 1 : n_ep == 0 ? 0 : n_dt));
    lemma_pair: assert (n_dt >= 1 && n_dt <= MAX_TICKS && n_ep <= MAX_COUNT && (n_ep == 1 || n_dt == 1));
    lemma_held: assert (n_ep_ != 0 || velocity == 0);
    lemma_rest: assert (core_forced == was_alone && core_at_rest == was_rest && (!was_rest || n_ep == 0));
    lemma_rests: assert (quiet <= MAX_TICKS + 1 && rested == (quiet > MAX_TICKS) && core_rests == rested
        && core_silent == (quiet != 0)
        && (quiet == 0 || rested || core_empty == MAX_TICKS - 1 - $signed({1'b0, quiet})));
    lemma_size: assert (pulse_count <= MAX_COUNT && -pulse_count <= MAX_COUNT);
    lemma_sum: assert (core_sum <= MAX_COUNT + 1 && -core_sum <= MAX_COUNT + 1
        && core_outside == (core_sum > MAX_COUNT || -core_sum > MAX_COUNT));
    lemma_waits: assert (c_dt == MAX_TICKS ? n_ep == 0 : idle <= c_dt * T + clock);
  end
  always @* begin
    pr_tick: assert (tick == tick_);
    pr_range: assert (c_dt <= MAX_TICKS && core_dt <= MAX_TICKS && core_more < MAX_COUNT && core_left >= -1
        && core_more + core_any == (c_ep > MAX_COUNT ? MAX_COUNT : c_ep));
    pr_update: assert (velocity_valid == update_);
    pr_estimate: assert (n_ep1 == ep_ && n_dt1 == dt_ && forced == alone_);
    pr_velocity: assert (ep_ == 0 ? velocity == 0 : have <= wanted && wanted < have + 2 * q);
    pr_standstill: assert (standstill == still);
    pr_rest: assert (idle_ < MAX_TICKS * T || velocity == 0);
    pr_flag: assert (!more_ || overflow);
  end
endmodule
