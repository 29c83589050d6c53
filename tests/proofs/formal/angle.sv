// Properties of the electrical angle of a method that updates at counts: any steps, velocities and sets, and `rst` at any
// time. A count adds 2^28·POLE_PAIRS / COUNTS, exactly. The angle that is shown changes by no more than the way of a clock
// and an eighth of what it owes: not at all where a count or an update moves it, or while nothing does.
module angle #(
    parameter COUNTS = 96,
    parameter POLE_PAIRS = 7,
    parameter REST = 7,
    parameter HALF = 24
) (
    input clk, input rst, input [1:0] counts, input valid, input signed [7:0] velocity, input tick, input set,
    input [7:0] position, input [15:0] value, input [15:0] offset, input [15:0] lead
);
  localparam [63:0] TURNS = POLE_PAIRS << 28;
  localparam signed [27:0] QUOTIENT = TURNS / COUNTS;
  localparam signed [REST+1:0] REMAINDER = TURNS % COUNTS, FULL = COUNTS;
  wire signed [1:0] step = counts == 2 ? 0 : counts;
  tachometer core (
      .clk(clk), .rst(rst), .counted_step(step), .counted_native_velocity(velocity), .counted_native_valid(valid),
      .counted_tick(tick), .counted_angle_set(set), .counted_position(position), .counted_angle_value(value),
      .counted_angle_offset(offset), .counted_angle_lead(lead)
  );
  wire [27:0] core_sum_;
  wire [REST-1:0] core_rest;
  wire [27:0] core_phase;
  wire signed [27:0] core_debt;
  wire signed [HALF:0] core_grows, core_place;
  wire signed [HALF+1:0] core_room;
  wire [27:0] core_ahead;
  wire core_moved;

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

  localparam signed [HALF+1:0] EDGE = QUOTIENT >>> 1;
  reg moved_ = 0;
  reg [27:0] phase_ = 0, coming_ = 2048, ahead_ = 0;
  reg signed [27:0] debt_ = 0;
  reg signed [HALF:0] place_ = 0, grows_ = 0;
  wire signed [27:0] eighth = debt_ >>> 3;
  wire [27:0] owed = eighth + (debt_ < 0 && debt_[2:0] != 0);
  wire signed [HALF+1:0] way = core_place - place_;
  always @(posedge clk) begin
    moved_ <= core_moved;
    phase_ <= core_phase;
    coming_ <= $signed(core_sum_) + core_place + $signed(core_ahead);
    {ahead_, debt_, place_, grows_} <= {core_ahead, core_debt, core_place, core_grows};
  end
  always @* begin
    pe_range: assert (core_rest < COUNTS);
    pe_exact: assert (was_reset ? core_sum_ == 2048 && core_rest == 0
                      : late == 1 ? up : late == 0 ? angle == 0 && left == 0 : down);
    pe_place: assert (core_place <= EDGE && core_place >= -EDGE && core_grows <= EDGE && core_grows >= -EDGE);
    pe_room: assert (core_room == (core_grows < 0 ? -EDGE : EDGE) - core_grows);
    pe_phase: assert (was_reset || core_phase == coming_);
    pe_debt: assert (was_reset || core_debt == (moved_ ? debt_ + (phase_ - core_phase) : debt_ - owed));
    pe_step: assert (was_reset || core_moved || core_ahead == ahead_ && core_sum_ == sum_
                     && (grows_ < 0 ? way <= 0 && way >= grows_ : way >= 0 && way <= grows_));
  end
endmodule
