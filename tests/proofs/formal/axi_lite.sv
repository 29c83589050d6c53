// Properties of registers on AXI4-Lite: handshakes, and what is read, written and captured.
module axi_lite #(
    parameter IDENTIFICATION = 0,
    parameter CONFIGURATION = 0,
    parameter COUNT_WIDTH = 3,
    parameter FRAC_BITS = 4
) (
    input clk, input rst, input a, input b, input capture,
    input [5:0] awaddr, input [2:0] awprot, input awvalid, input [31:0] wdata, input [3:0] wstrb, input wvalid,
    input bready, input [5:0] araddr, input [2:0] arprot, input arvalid, input rready
);
  wire awready, wready, bvalid, arready, rvalid;
  wire [1:0] bresp, rresp;
  wire [31:0] rdata;
  tachometer core (
      .clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .pulse_count(pulse_count), .velocity(velocity),
      .velocity_valid(velocity_valid), .interval(interval), .forced(forced), .standstill(standstill), .overflow(overflow),
      .position(position), .decode_error(decode_error), .capture(capture), .s_axi_awaddr(awaddr), .s_axi_awprot(awprot),
      .s_axi_awvalid(awvalid), .s_axi_awready(awready), .s_axi_wdata(wdata), .s_axi_wstrb(wstrb), .s_axi_wvalid(wvalid),
      .s_axi_wready(wready), .s_axi_bresp(bresp), .s_axi_bvalid(bvalid), .s_axi_bready(bready), .s_axi_araddr(araddr),
      .s_axi_arprot(arprot), .s_axi_arvalid(arvalid), .s_axi_arready(arready), .s_axi_rdata(rdata), .s_axi_rresp(rresp),
      .s_axi_rvalid(rvalid), .s_axi_rready(rready)
  );
`include "bank.sv"

  wire core_writes, core_written, core_has_read, core_write_done, core_read_done;
  wire [3:0] core_to_write, core_to_read;
  wire core_by_byte_0;
  // What the core has taken and not answered yet, whether it has been done, and for how many clocks it has waited.
  reg have_aw = 0, have_w = 0, have_ar = 0, wrote = 0, has_read = 0;
  reg [3:0] aw = 0, ar = 0;
  reg [31:0] w = 0;
  reg by_byte_0 = 0;
  reg [2:0] b_late = 0, r_late = 0;
  // What the answers must be, from the clock after the access on.
  reg wrote_now = 0, read_now = 0, write_refused = 0, read_refused = 0;
  reg [31:0] data = 0;
  // Answers that the master has let wait.
  reg b_waited = 0, r_waited = 0, read_waited = 0;
  reg [1:0] b_was = 0;
  reg [33:0] r_was = 0;
  wire b_done = bvalid && bready, r_done = rvalid && rready;
  always @(posedge clk)
    if (rst) begin
      {have_aw, have_w, have_ar, wrote, has_read, b_late, r_late, b_waited, r_waited, read_waited} <= 0;
      {wrote_now, read_now} <= 0;
    end else begin
      have_aw <= (have_aw || awvalid && awready) && !b_done;
      have_w <= (have_w || wvalid && wready) && !b_done;
      have_ar <= (have_ar || arvalid && arready) && !r_done;
      if (awvalid && awready) aw <= awaddr[5:2];
      if (wvalid && wready) {w, by_byte_0} <= {wdata, wstrb[0]};
      if (arvalid && arready) ar <= araddr[5:2];
      wrote <= (wrote || core_writes) && !b_done;
      has_read <= (has_read || core_read) && !r_done;
      b_late <= have_aw && have_w && !bvalid ? b_late + 1 : 0;
      r_late <= have_ar && !rvalid ? r_late + 1 : 0;
      wrote_now <= core_writes;
      read_now <= core_read;
      if (wrote_now) write_refused <= was_refused;
      if (read_now) {read_refused, data} <= {was_refused, word};
      read_waited <= have_ar && !has_read && !core_read;
      b_waited <= bvalid && !bready;
      r_waited <= rvalid && !rready;
      b_was <= bresp;
      r_was <= {rresp, rdata};
    end

  always @* begin
    lemma_done: assert (core_write_done == wrote && core_read_done == has_read && core_written == wrote_now
        && core_has_read == read_now && (!wrote || have_aw && have_w) && (!has_read || have_ar));
    lemma_taken: assert ((!have_aw || core_to_write == aw) && (!have_ar || core_to_read == ar)
        && (!have_w || core_write_data == w && core_by_byte_0 == by_byte_0));
    lemma_valid: assert (bvalid == (wrote && !wrote_now) && rvalid == (has_read && !read_now));
    pa_ready: assert (awready == !have_aw && wready == !have_w && arready == !have_ar);
    pa_write: assert (core_writes == (have_aw && have_w && !wrote) && core_write == (core_writes && by_byte_0)
        && (!core_write || core_address == aw && core_write_data == w));
    pa_read: assert (!core_read || have_ar && !has_read && core_address == ar && !core_write);
    pa_turn: assert (!read_waited || has_read || core_read);
    pa_bound: assert ((bvalid || b_late <= 1) && (rvalid || r_late <= 2));
    pa_only: assert ((!bvalid || have_aw && have_w && wrote) && (!rvalid || have_ar && has_read));
    pa_stable: assert ((!b_waited || bvalid && bresp == b_was) && (!r_waited || rvalid && {rresp, rdata} == r_was));
    pa_written: assert (!bvalid || bresp == {write_refused, 1'b0});
    pa_data: assert (!rvalid || rresp == {read_refused, 1'b0} && rdata == data);
  end
endmodule
