// Properties of registers on Wishbone: handshakes, and what is read, written and captured.
module wishbone #(
    parameter IDENTIFICATION = 0,
    parameter CONFIGURATION = 0,
    parameter COUNT_WIDTH = 3,
    parameter FRAC_BITS = 4
) (
    input clk, input rst, input a, input b, input capture,
    input [5:0] wb_adr_i, input [31:0] wb_dat_i, input [3:0] wb_sel_i, input wb_we_i, input wb_cyc_i, input wb_stb_i
);
  wire [31:0] wb_dat_o;
  wire wb_ack_o, wb_err_o;
  tachometer core (
      .clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .pulse_count(pulse_count), .velocity(velocity),
      .velocity_valid(velocity_valid), .interval(interval), .forced(forced), .standstill(standstill), .overflow(overflow),
      .position(position), .decode_error(decode_error), .capture(capture), .wb_adr_i(wb_adr_i), .wb_dat_i(wb_dat_i),
      .wb_dat_o(wb_dat_o), .wb_sel_i(wb_sel_i), .wb_we_i(wb_we_i), .wb_cyc_i(wb_cyc_i), .wb_stb_i(wb_stb_i),
      .wb_ack_o(wb_ack_o), .wb_err_o(wb_err_o)
  );
`include "bank.sv"

  wire core_answered;
  wire wanted = wb_cyc_i && wb_stb_i, answer = wb_ack_o || wb_err_o;
  // There was a clock with a request that was not answered: it reached the registers in that clock.
  reg unanswered = 0;
  always @(posedge clk) unanswered <= !rst && wanted && !answer;
  wire access = wanted && !unanswered;

  always @* begin
    lemma_answered: assert (core_answered == unanswered);
    pw_access: assert (core_read == (access && !wb_we_i) && core_write == (access && wb_we_i && wb_sel_i[0])
        && core_address == wb_adr_i[5:2] && core_write_data == wb_dat_i);
    pw_answer: assert (answer == (wanted && unanswered) && !(wb_ack_o && wb_err_o));
    pw_error: assert (!answer || wb_err_o == was_refused);
    pw_data: assert (!(wb_ack_o && was_read) || wb_dat_o == word);
  end
endmodule
