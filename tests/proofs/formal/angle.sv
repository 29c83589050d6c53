// Properties of the electrical angle of a method that updates at counts: any steps, velocities and sets, and `rst` at any
// time. A count adds 2^28·POLE_PAIRS / COUNTS, exactly.
module angle #(
    parameter COUNTS = 96,
    parameter POLE_PAIRS = 7,
    parameter REST = 7
) (
    input clk, input rst, input [1:0] way, input valid, input signed [7:0] velocity, input tick, input set,
    input [7:0] position, input [15:0] value, input [15:0] offset, input [15:0] lead
);
  localparam [63:0] TURNS = POLE_PAIRS << 28;
  localparam signed [27:0] QUOTIENT = TURNS / COUNTS;
  localparam signed [REST+1:0] REMAINDER = TURNS % COUNTS, FULL = COUNTS;
  wire signed [1:0] step = way == 2 ? 0 : way;
  tachometer core (
      .clk(clk), .rst(rst), .counted_step(step), .counted_native_velocity(velocity), .counted_native_valid(valid),
      .counted_tick(tick), .counted_angle_set(set), .counted_position(position), .counted_angle_value(value),
      .counted_angle_offset(offset), .counted_angle_lead(lead)
  );
  wire [27:0] core_sum_;
  wire [REST-1:0] core_rest;

  reg was_reset = 1;
  reg signed [1:0] step_ = 0, late = 0;
  reg [27:0] sum_ = 0;
  reg [REST-1:0] rest_ = 0;
  always @(posedge clk) begin
    was_reset <= rst;
    step_ <= rst ? 0 : step;
    late <= rst ? 0 : step_;
    {sum_, rest_} <= {core_sum_, core_rest};
  end
  wire signed [27:0] angle = core_sum_ - sum_;
  wire signed [REST+1:0] left = core_rest - rest_;
  wire up = angle == QUOTIENT && left == REMAINDER || angle == QUOTIENT + 1 && left == REMAINDER - FULL;
  wire down = angle == -QUOTIENT && left == -REMAINDER || angle == -QUOTIENT - 1 && left == FULL - REMAINDER;
  always @* begin
    pe_range: assert (core_rest < COUNTS);
    pe_exact: assert (was_reset ? core_sum_ == 2048 && core_rest == 0
                      : late == 1 ? up : late == 0 ? angle == 0 && left == 0 : down);
  end
endmodule
