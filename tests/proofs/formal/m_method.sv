// Properties of the M method with a tick in every clock and with bounds: from the ticks at the ports to the updates at the
// ports. The reference keeps the pulse numbers of the n ticks and adds them up. `rst` may come at any time.
module m_method #(
    parameter N = 1,              // ticks that are averaged
    parameter MAX_COUNT = 1,
    parameter COUNT_WIDTH = 2,
    parameter MAX_TICKS = 4,
    parameter INTERVAL_WIDTH = 1,
    parameter BOUND_WIDTH = 7,
    parameter FRAC_BITS = 4,
    parameter TICK_TO_VELOCITY = 1
) (
    input clk, input rst, input a, input b
);
  localparam V = COUNT_WIDTH + FRAC_BITS, I = INTERVAL_WIDTH, S = COUNT_WIDTH + 8;
  wire tick, velocity_valid, forced, standstill, bounds_valid, overflow;
  wire signed [COUNT_WIDTH-1:0] pulse_count;
  wire signed [V-1:0] velocity;
  wire signed [BOUND_WIDTH-1:0] velocity_lower, velocity_upper;
  wire [I-1:0] interval;
  tachometer core (
      .clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .pulse_count(pulse_count), .velocity(velocity),
      .velocity_valid(velocity_valid), .interval(interval), .forced(forced), .standstill(standstill), .overflow(overflow),
      .velocity_lower(velocity_lower), .velocity_upper(velocity_upper), .bounds_valid(bounds_valid)
  );

  // m_e(i-1) ... m_e(i-n+1), and how many ticks there have been, at most n; zeros before reset.
  reg [COUNT_WIDTH*N-1:0] past = 0;
  reg [7:0] ticks = 0;
  wire [COUNT_WIDTH*(N+1)-1:0] m_e = {past, pulse_count};
  reg signed [S-1:0] sum;
  reg signed [COUNT_WIDTH-1:0] m_e_j;
  reg bounded;
  integer j;
  always @* begin
    sum = 0;
    bounded = 1;
    for (j = 0; j < N; j = j + 1) begin
      m_e_j = m_e[COUNT_WIDTH*j+:COUNT_WIDTH];
      sum = sum + m_e_j;
      if (m_e_j > MAX_COUNT || m_e_j < -MAX_COUNT) bounded = 0;
    end
  end
  always @(posedge clk)
    if (rst) {past, ticks} <= 0;
    else if (tick) begin
      past <= m_e;
      ticks <= ticks < N ? ticks + 1 : N;
    end

  wire rests, rested;
  wire [31:0] quiet;
  wire signed [$clog2(MAX_TICKS - 1):0] core_empty;
  wire core_rests, core_silent;
  standstill #(MAX_TICKS, COUNT_WIDTH) still (clk, rst, tick, pulse_count, rests, rested, quiet);

  // As late as the core shows them.
  wire tick_, known_;
  wire signed [S-1:0] sum_;
  delay #(2 + S, TICK_TO_VELOCITY) delays (clk, rst, {tick, ticks == N, sum}, {tick_, known_, sum_});

  // n times what is shown, against 2^f times what was counted.
  wire signed [S+FRAC_BITS:0] scaled = sum_ <<< FRAC_BITS, one = 1 <<< FRAC_BITS;
  wire signed [S+FRAC_BITS:0] shown = N * velocity, lower = N * velocity_lower, upper = N * velocity_upper;
  wire signed [S+FRAC_BITS:0] below = scaled - one - lower, above = upper - scaled - one;
  always @* begin
    lemma_bounded: assert (bounded && ticks <= N);
    lemma_rests: assert (quiet <= MAX_TICKS + 1 && rested == (quiet > MAX_TICKS) && core_rests == rested
        && core_silent == (quiet != 0)
        && (quiet == 0 || rested || core_empty == MAX_TICKS - 1 - $signed({1'b0, quiet})));
    pm_update: assert (velocity_valid == tick_ && interval == N && !forced);
    pm_velocity: assert (!velocity_valid || (2 * shown <= 2 * scaled + N && 2 * scaled + N < 2 * shown + 2 * N));
    pm_standstill: assert (standstill == rests);
    pm_bounds: assert (!velocity_valid || (below >= 0 && below < N && above >= 0 && above < N));
    pm_known: assert (!velocity_valid || bounds_valid == known_);
  end
endmodule
