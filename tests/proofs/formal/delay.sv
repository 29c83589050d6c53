// D clocks of delay, 0 after reset.
module delay #(
    parameter WIDTH = 1,
    parameter D = 1
) (
    input clk, input rst, input [WIDTH-1:0] d, output [WIDTH-1:0] q
);
  reg [WIDTH*(D+1)-1:0] line = 0;  // the stage beyond the last is not used, so that D may be 0
  wire [WIDTH*(D+1)-1:0] all = {line, d};
  always @(posedge clk) line <= rst ? 0 : all;
  assign q = all[WIDTH*D+:WIDTH];
endmodule
