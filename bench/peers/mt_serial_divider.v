// The M/T method as textbooks draw it, with a serial divider: a peer of the cores, for docs/measured/size.md.
//
// A window is 960 clocks: 20 us at 48 MHz. Over the windows since the last one with edges, `count` sums the edges of A
// and B (x4, signed), and the clock timer is read at each edge. At the end of a window with edges
//
//     velocity = count * 960 * 2^16 / (clocks from the last edge of that earlier window to the last edge of this one),
//
// in counts per window with 16 fraction bits, rounded towards zero; it is valid 39 clocks after the end of the window.
// Without edges the velocity is held, and after 500 such windows (10 ms) it is zero until there are two edges again.
module mt_serial_divider (
  input clk,
  input rst,
  input a,
  input b,
  output reg signed [26:0] velocity,
  output reg velocity_valid
);
  // Inputs: two flip-flops against metastability, a third for the edges. If both inputs change at once nothing counts.
  reg [2:0] past_a, past_b;
  wire step = past_a[1] ^ past_a[2] ^ past_b[1] ^ past_b[2];
  wire up = past_a[1] ^ past_b[2];
  wire signed [10:0] change = !step ? 11'sd0 : up ? 11'sd1 : -11'sd1;

  // Windows, edges and times. The timer wraps; its differences are at most 501 windows, below 2^19 clocks.
  reg [9:0] phase;
  reg [18:0] timer, latest, reference;
  reg signed [10:0] count;
  reg [8:0] idle;
  reg tick, seen, moving;

  // The divider: magnitude of the dividend, restoring steps of one bit, most significant bit first, then the sign.
  reg [9:0] magnitude;
  reg negative, scaling;
  reg [18:0] divisor, remainder;
  reg [35:0] work;
  reg [5:0] left;
  reg finishing;
  wire [19:0] scaled = {magnitude, 10'd0} - {magnitude, 6'd0};
  wire [19:0] trial = {remainder, work[35]} - {1'b0, divisor};

  always @(posedge clk) begin
    past_a <= {past_a[1:0], a};
    past_b <= {past_b[1:0], b};
    timer <= timer + 19'd1;
    phase <= tick ? 10'd0 : phase + 10'd1;
    tick <= phase == 10'd958;
    if (step) latest <= timer;
    count <= tick ? change : count + change;
    seen <= step | (seen & !tick);
    velocity_valid <= finishing;
    scaling <= tick & seen & moving;
    finishing <= left == 6'd1;
    if (tick & seen) begin
      magnitude <= count[10] ? -count : count;
      negative <= count[10];
      divisor <= latest - reference;
      reference <= latest;
      moving <= 1'b1;
      idle <= 9'd0;
    end else if (tick) begin
      if (idle != 9'd499) idle <= idle + 9'd1;
      else begin
        moving <= 1'b0;
        velocity <= 27'sd0;
        velocity_valid <= 1'b1;
      end
    end
    if (scaling) begin
      work <= {scaled, 16'd0};
      remainder <= 19'd0;
      left <= 6'd36;
    end else if (left != 6'd0) begin
      remainder <= trial[19] ? {remainder[17:0], work[35]} : trial[18:0];
      work <= {work[34:0], !trial[19]};
      left <= left - 6'd1;
    end
    if (finishing) velocity <= negative ? -{1'b0, work[25:0]} : {1'b0, work[25:0]};
    if (rst) begin
      {phase, tick, timer, count, seen, moving, idle, scaling, finishing, left, velocity_valid} <= 0;
      velocity <= 27'sd0;
    end
  end
endmodule
