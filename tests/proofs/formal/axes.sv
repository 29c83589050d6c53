// Counts of many axes: each step that an axis takes between two looks is in its own sum and in no other.
module axes #(
    parameter AXES = 2,
    parameter SLOTS = 4,
    parameter ROUNDS = 2,
    parameter COUNT_WIDTH = 3
) (
    input clk, input rst, input [AXES-1:0] a, input [AXES-1:0] b
);
  localparam C = COUNT_WIDTH, S = $clog2(SLOTS);
  wire [S-1:0] axis;
  wire signed [1:0] step;
  wire signed [C-1:0] count;
  wire complete, decode_error;
  tachometer core (
      .clk(clk), .rst(rst), .level_a(a), .level_b(b), .axis(axis), .step(step), .count(count), .complete(complete),
      .decode_error(decode_error)
  );

  wire [S-1:0] core_slot;
  wire [2:0] core_warmed;
  wire core_first, core_last;

  // The clock of a round, the round of a tick, and the rounds since reset, at most 3.
  reg [S-1:0] slot = 0;
  reg [$clog2(ROUNDS + 1)-1:0] round = 0;
  reg [1:0] warm = 0;
  wire ends = slot == SLOTS - 1, last = round == ROUNDS - 1;
  always @(posedge clk) begin
    slot <= rst || ends ? 0 : slot + 1;
    round <= rst ? 0 : !ends ? round : last ? 0 : round + 1;
    warm <= rst ? 0 : ends && warm < 3 ? warm + 1 : warm;
  end

  // What was three clocks ago.
  wire [S-1:0] slot_;
  wire last_, seen;
  delay #(S + 2, 3) delays (clk, rst, {slot, last, 1'b1}, {slot_, last_, seen});

  // Every axis by the Gray phase 00, 10, 11, 01 = 0, 1, 2, 3 of its lines, with counters of its own.
  wire [AXES-1:0] wrong_step, wrong_count, wrong_error;
  genvar k;
  generate
    for (k = 0; k < AXES; k = k + 1) begin : own
      wire [1:0] phase = {b[k], a[k] ^ b[k]};
      reg [1:0] past = 0;
      wire [1:0] turned = phase - past;
      wire signed [1:0] now = warm < 3 ? 0 : turned == 1 ? 1 : turned == 3 ? -1 : 0;
      reg signed [1:0] moved = 0;
      reg signed [C-1:0] sum = 0;
      reg illegal = 0;
      always @(posedge clk) begin
        if (rst) {past, moved, sum, illegal} <= 0;
        else if (slot == k) begin
          past <= phase;
          moved <= now;
          sum <= (round == 0 ? 0 : sum) + now;
          illegal <= warm == 3 && turned == 2;
        end
      end
      wire mine = seen && slot_ == k;
      assign wrong_step[k] = mine && step != moved;
      assign wrong_count[k] = mine && count != sum;
      assign wrong_error[k] = mine && decode_error != illegal;
    end
  endgenerate
  always @* begin
    px_axis: assert (!seen || axis == slot_);
    px_step: assert (wrong_step == 0);
    px_count: assert (wrong_count == 0);
    px_error: assert (wrong_error == 0);
    px_complete: assert (!seen || complete == last_);
    lemma_slot: assert (slot < SLOTS && round < ROUNDS && core_slot == slot && core_warmed == (1 << warm) - 1);
    lemma_round: assert (core_first == (round == 0) && core_last == last);
  end
endmodule
