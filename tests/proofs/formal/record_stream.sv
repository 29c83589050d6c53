// Properties of the stream of records, alone: the protocol of AXI4-Stream, and what is sent, dropped and counted.
module record_stream #(
    parameter PACKET = 3
) (
    input clk, input rst, input comes, input flag, input signed [2:0] position, input clear, input tready
);
  wire [127:0] tdata;
  wire tvalid, tlast;
  wire [15:0] overruns;
  tachometer core (
      .clk(clk), .rst(rst), .tick(comes), .overflow(flag), .position(position), .clear(clear), .m_axis_tdata(tdata),
      .m_axis_tvalid(tvalid), .m_axis_tlast(tlast), .m_axis_tready(tready), .overruns(overruns)
  );
  wire [31:0] core_clocks;
  wire core_lost;
  wire [1:0] core_left;

  // The record that waits, its place in its packet, and what was dropped.
  reg waits = 0, lost = 0, stalled = 0;
  reg [31:0] clocks = 0, waiting_time = 0;
  reg [1:0] waiting_flags = 0;
  reg signed [31:0] waiting_position = 0;
  reg [1:0] place = PACKET - 1;
  reg [15:0] dropped = 0;
  reg [128:0] was = 0;
  wire taken = waits && tready;
  always @(posedge clk)
    if (rst) begin
      {waits, lost, stalled, clocks, waiting_time, waiting_flags, waiting_position, dropped} <= 0;
      place <= PACKET - 1;
    end else begin
      clocks <= clocks + 1;
      stalled <= tvalid && !tready;
      was <= {tlast, tdata};
      waits <= comes || (waits && !taken);
      if (comes) lost <= waits && !taken;
      if (comes && (!waits || taken)) begin
        waiting_time <= clocks;
        waiting_flags <= {flag, lost};
        waiting_position <= position;
        place <= place == PACKET - 1 ? 0 : place + 1;
      end
      dropped <= clear ? 0 : comes && waits && !taken && dropped != 16'hffff ? dropped + 1 : dropped;
    end

  always @* begin
    lemma_clocks: assert (core_clocks == clocks && core_lost == lost);
    lemma_place: assert (place < PACKET && core_left == (place == PACKET - 1 ? PACKET - 1 : PACKET - 2 - place));
    ps_valid: assert (tvalid == waits);
    ps_stable: assert (!stalled || (tvalid && {tlast, tdata} == was));
    ps_record: assert (!tvalid || tdata == {waiting_position, 30'd0, waiting_flags, waiting_time});
    ps_last: assert (!tvalid || tlast == (place == PACKET - 1));
    ps_overruns: assert (overruns == dropped);
  end
endmodule
