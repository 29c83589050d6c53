// What `standstill` must show: more than MAX_TICKS ticks in a row without a count, the one before the first included.
module standstill #(
    parameter MAX_TICKS = 4,
    parameter COUNT_WIDTH = 3
) (
    input clk, input rst, input tick, input signed [COUNT_WIDTH-1:0] pulse_count,
    output rests,                 // in this clock
    output rested,                // in the one before
    output [31:0] quiet           // ticks without a count before this clock, at most one more than MAX_TICKS
);
  localparam W = $clog2(MAX_TICKS + 2);
  reg [W-1:0] count = 1;
  reg last = 0;
  wire [W-1:0] next = pulse_count != 0 ? 0 : count > MAX_TICKS ? MAX_TICKS + 1 : count + 1;
  always @(posedge clk)
    if (rst) begin
      count <= 1;
      last <= 0;
    end else begin
      if (tick) count <= next;
      last <= rests;
    end
  assign rests = tick ? next > MAX_TICKS : last;
  assign rested = last;
  assign quiet = count;
endmodule
