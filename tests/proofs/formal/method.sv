// Properties of the S method: from the ticks at the ports to the updates at the ports. The reference keeps the pulse
// numbers of a whole window and adds them up as the paper does; it has neither d0 nor d1. `rst` may come at any time.
// core_* show signals of the core to the lemmas, and to p5_numerator what enters the scaler; prove.py connects them.
module method #(
    parameter T = 4,              // tick_cycles
    parameter MAX_TICKS = 8,
    parameter MAX_COUNT = 4,
    parameter COUNT_WIDTH = 4,
    parameter SUM_WIDTH = 4,      // bits of the sum of a window
    parameter START = 0,          // what it is raised by
    parameter INTERVAL_WIDTH = 4,
    parameter NUMERATOR_WIDTH = 6,
    parameter FRAC_BITS = 4,
    parameter CANCEL = 1,
    parameter TICK_LATENCY = 2,
    parameter TICK_TO_VELOCITY = 9,
    parameter CARRIED = 0,        // the table of the carried reciprocal has that many entries; 0: none is carried
    parameter C = 8,              // what it divides
    parameter SERIAL = 0,         // m_s stays until the update is shown
    parameter AGE = 0,            // there is an age
    parameter UPSET = 0           // whether an update is due and what b is are taken from the core, which may have any state
) (
    input clk, input rst, input a, input b
);
  localparam V = COUNT_WIDTH + FRAC_BITS, I = INTERVAL_WIDTH, S = COUNT_WIDTH + INTERVAL_WIDTH + 2, KEPT = MAX_TICKS / 2;
  wire tick, velocity_valid, forced, standstill;
  wire signed [COUNT_WIDTH-1:0] pulse_count;
  wire signed [V-1:0] velocity;
  wire [I-1:0] interval;
  tachometer core (
      .clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .pulse_count(pulse_count), .velocity(velocity),
      .velocity_valid(velocity_valid), .interval(interval), .forced(forced), .standstill(standstill)
  );
  wire [I-1:0] core_m_s;
  wire core_longest, core_rests, core_nearly, core_alteration;
  wire signed [COUNT_WIDTH-1:0] core_opening, core_offset;
  wire signed [NUMERATOR_WIDTH-1:0] core_numerator;
  wire signed [SUM_WIDTH-1:0] core_sum;
  wire signed [SUM_WIDTH:0] core_count = core_sum - START;

  // m_e(i-1) ... m_e(i-max_ticks); zeros before reset. m_s = i - a, by the rules of the alteration.
  reg [COUNT_WIDTH*MAX_TICKS-1:0] past = 0;
  reg signed [COUNT_WIDTH-1:0] offset = 0;
  reg [I-1:0] m_s = 1;
  wire [COUNT_WIDTH*(MAX_TICKS+1)-1:0] m_e = {past, pulse_count};
  wire signed [COUNT_WIDTH-1:0] previous = past[0+:COUNT_WIDTH];
  wire signed [COUNT_WIDTH-1:0] usual = UPSET ? core_offset : offset;
  wire alteration = pulse_count != previous && pulse_count != usual;
  wire full = (UPSET ? core_m_s : m_s) == MAX_TICKS;
  wire update = tick && (alteration || full);
  always @(posedge clk)
    if (rst) begin
      past <= 0;
      offset <= 0;
      m_s <= 1;
    end else if (tick) begin
      past <= m_e;
      offset <= alteration ? usual : pulse_count;
      m_s <= alteration ? 1 : full ? KEPT + 1 : m_s + 1;
    end

  // Twice the sum of eq. (21), where the ends count half, or of eq. (17), without the opening tick.
  reg signed [S-1:0] sum;
  reg alike;  // all numbers inside the window are the same
  reg bounded;
  reg signed [COUNT_WIDTH-1:0] m_e_j, opening;
  integer j;
  always @* begin
    sum = 0;
    alike = 1;
    bounded = 1;
    opening = 0;
    for (j = 0; j <= MAX_TICKS; j = j + 1) begin
      m_e_j = m_e[COUNT_WIDTH*j+:COUNT_WIDTH];
      if (j == 0) sum = sum + (CANCEL ? m_e_j : 2 * m_e_j);
      else if (j < m_s) sum = sum + 2 * m_e_j;
      else if (j == m_s && CANCEL) sum = sum + m_e_j;
      if (j == m_s) opening = m_e_j;
      if (j > 0 && j < m_s && m_e_j != previous) alike = 0;
      if (m_e_j > MAX_COUNT || m_e_j < -MAX_COUNT) bounded = 0;
    end
  end
  // What enters the scaler is there a clock before the tick.
  reg signed [NUMERATOR_WIDTH-1:0] numerator = 0;
  always @(posedge clk) numerator <= rst ? 0 : core_numerator;
  wire signed [S-1:0] reduced = 2 * $signed({1'b0, core_m_s}) * previous + (CANCEL ? numerator : 2 * numerator);

  // The window that closed, while the core still works on it.
  reg [TICK_TO_VELOCITY-1:0] closed = 0;  // in which of the clocks before
  reg [I-1:0] pending_m_s = 1;
  wire pending = SERIAL && closed != 0;
  always @(posedge clk) begin
    closed <= rst ? 0 : {closed, update};
    if (update) pending_m_s <= m_s;
  end

  // Ticks since the last update, and what that was: once here, and once from the ports.
  reg [I-1:0] since = 0, since_update = 0;
  reg after_forced = 0, was_forced = 0;
  always @(posedge clk)
    if (rst) {since, after_forced} <= 0;
    else if (tick) begin
      since <= update ? 0 : since + 1;
      if (update) after_forced <= !alteration;
    end

  wire rests, rested;
  wire [31:0] quiet;
  standstill #(MAX_TICKS, COUNT_WIDTH) still (clk, rst, tick, pulse_count, rests, rested, quiet);

  // As late as the core shows them.
  wire tick_, update_, forced_, after_forced_;
  wire [I-1:0] m_s_, since_;
  wire signed [S-1:0] sum_;
  delay #(4 + 2 * I + S, TICK_TO_VELOCITY) delays (
      clk, rst,
      {tick, update, !alteration, after_forced, m_s, since, sum},
      {tick_, update_, forced_, after_forced_, m_s_, since_, sum_}
  );
  reg [V+I:0] held = 0;
  wire [V+I:0] outputs = {velocity, interval, forced};
  always @(posedge clk)
    if (rst) {since_update, was_forced, held} <= 0;
    else begin
      if (tick_) since_update <= since_update + 1;
      if (velocity_valid) {since_update, was_forced} <= {{I{1'b0}}, forced};
      held <= outputs;
    end

  // What is shown: this update, or the last one.
  reg signed [S-1:0] last_sum = 0;
  reg [I-1:0] last_m_s = 0;  // 0: none
  reg last_forced = 0;
  wire signed [S-1:0] shown_sum = velocity_valid ? sum_ : last_sum;
  wire [I-1:0] shown_m_s = velocity_valid ? m_s_ : last_m_s;
  wire shown_forced = velocity_valid ? forced_ : last_forced;
  always @(posedge clk) {last_sum, last_m_s, last_forced} <= rst ? 0 : {shown_sum, shown_m_s, shown_forced};

  // 2^f x + 1/2 = (2^f sum + m_s) / (2 m_s), rounded down.
  wire signed [S+FRAC_BITS:0] wanted = (shown_sum <<< FRAC_BITS) + $signed({1'b0, shown_m_s});
  wire signed [S+FRAC_BITS:0] have = 2 * $signed({1'b0, shown_m_s}) * velocity;
  wire signed [I+1:0] divisor = $signed({1'b0, shown_m_s, 1'b0});

  // Lemmas: what the induction needs to know of the state.
  reg [$clog2(T):0] clock = 0;
  always @(posedge clk) clock <= rst || clock == T - 1 ? 0 : clock + 1;
  wire signed [$clog2(T)+1:0] elapsed = $signed({1'b0, clock}), most = clock == 0 ? T : elapsed;
  reg signed [$clog2(T)+1:0] most_before = 0;
  always @(posedge clk) most_before <= rst ? 0 : most;
  wire signed [$clog2(T)+1:0] bound = TICK_LATENCY > 2 ? most_before : most;  // the step may come a clock later
  generate
    if (T > 1) begin : window
      wire signed [$clog2(T - 1):0] core_left;
      always @* lemma_window: assert (core_left == T - 2 - elapsed);
    end
  endgenerate
  always @* begin
    lemma_clock: assert (clock < T);
    lemma_count: assert (core_count <= bound && -core_count <= bound);
    lemma_bounded: assert (bounded && (UPSET || (offset <= MAX_COUNT && -offset <= MAX_COUNT)));
    lemma_core: assert (core_m_s == (pending ? pending_m_s : m_s) && core_longest == (pending ? pending_m_s == MAX_TICKS : full)
        && core_offset == offset);
    lemma_last: assert (tick || pulse_count == previous);
    lemma_alteration: assert (!tick || core_alteration == alteration);
    lemma_opening: assert (core_opening == opening);
    lemma_m_s: assert (m_s >= 1 && m_s <= MAX_TICKS && m_s == since + 1 + (after_forced ? KEPT : 0));
    lemma_alike: assert (alike);
    lemma_offset: assert (m_s == 1 || offset == previous);
    lemma_rests: assert (core_rests == rested && quiet <= MAX_TICKS + 1 && rested == (quiet > MAX_TICKS));
    // A silence begins in the opening tick, or in the one after it.
    lemma_quiet: assert (quiet == 0 || (previous == 0 && (rested || (m_s == quiet && opening == 0)
        || (m_s == quiet + 1 && opening != 0) || (core_nearly && quiet == MAX_TICKS))));
    lemma_nearly: assert (!core_nearly || quiet >= MAX_TICKS);
    lemma_counted: assert ((quiet == 0) == (previous != 0));
    lemma_since: assert ({since_update, was_forced} == {since_, after_forced_});
  end
  generate
    if (SERIAL) begin : serial
      wire signed [NUMERATOR_WIDTH-1:0] core_known;
      reg before = 0;
      always @(posedge clk) before <= !rst && tick;
      always @* lemma_known: assert (tick || before || core_known == (CANCEL ? opening - 2 * pulse_count : -pulse_count));
    end
    if (AGE) begin : aged
      wire [I-1:0] core_age;
      // Ticks that are not as old as the latency, and those since the cause of the update that are.
      reg [TICK_TO_VELOCITY-2:0] line = 0;
      reg [7:0] recent;
      integer k;
      always @(posedge clk) line <= rst ? 0 : {line, tick};
      always @* begin
        recent = 0;
        for (k = 0; k < TICK_TO_VELOCITY - 1; k = k + 1) recent = recent + line[k];
      end
      wire [7:0] all = recent + tick + (velocity_valid ? 0 : since_update + tick_);
      always @* p8_age: assert (core_age == (all < MAX_TICKS ? all : MAX_TICKS));
    end
    if (CARRIED) begin : carried
      localparam Q = $clog2(C / CARRIED + 1);
      wire core_carried;
      wire [$clog2(C):0] core_q;
      wire [I-1:0] core_r;
      wire signed [(I > Q ? I : Q):0] core_less;
      wire [Q-1:0] core_carried_q;
      reg [I-1:0] m = 0;  // at the last tick
      wire [I+$clog2(C):0] product = core_q * m;
      always @(posedge clk) m <= rst ? 0 : tick ? m_s : m;
      always @* begin
        lemma_next: assert (m_s == 1 || (m != 0 && m_s == (m == MAX_TICKS ? KEPT : m) + 1));
        lemma_less: assert (!core_carried || core_less == $signed({1'b0, core_r}) - $signed({1'b0, core_q}));
        // What the last of the table leaves there.
        lemma_ready: assert (m == 0 || m >= CARRIED || (core_less == C % CARRIED && core_carried_q == C / CARRIED));
        lemma_carried: assert (core_carried == (m >= CARRIED));
        lemma_reciprocal: assert (m == 0 || (core_r < m && product + core_r == C));
      end
    end
  endgenerate
  always @* begin
    p4_update: assert (velocity_valid == update_);
    p4_interval: assert (interval == shown_m_s && forced == shown_forced);
    p4_range: assert (!velocity_valid || (interval >= 1 && interval <= MAX_TICKS));
    p4_latest: assert (since_update < MAX_TICKS - (was_forced ? KEPT : 0));
    p4_held: assert (velocity_valid || outputs == held);
    p5_numerator: assert (!tick || sum == reduced);
    p5_velocity: assert ((have <= wanted && wanted < have + divisor) || (shown_m_s == 0 && velocity == 0));
    p7_standstill: assert (standstill == rests);
    p7_falls: assert (!(tick && pulse_count != 0) || !standstill);
  end
endmodule
