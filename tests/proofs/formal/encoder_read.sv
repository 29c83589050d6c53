// Properties of the master of an encoder with BiSS-C, alone: what it takes of a frame, and that each read ends in time.
module encoder_read #(
    parameter W = 3,
    parameter HALF = 2,
    parameter WAIT = 12,
    parameter LONGEST = 51
) (
    input clk, input rst, input encoder_data, input start
);
  localparam CRC = 3, N = W + 2 + CRC;
  localparam IDLE = 0, ANSWER = 1, START = 2, DONE = 3, CDS = 4, FRAME = 5, REST = 6;
  wire encoder_clock, sample_valid, sample_ok, sample_warning;
  wire [W-1:0] sample;
  wire [5:0] sample_age;
  wire [1:0] reason;
  tachometer core (
      .clk(clk), .rst(rst), .encoder_clock(encoder_clock), .encoder_data(encoder_data), .start(start), .sample(sample),
      .sample_valid(sample_valid), .sample_age(sample_age), .sample_ok(sample_ok), .sample_warning(sample_warning),
      .reason(reason)
  );
  wire core_line, core_silent;
  wire [1:0] core_at, core_flags;
  wire [2:0] core_state, core_left, core_check;

  // The remainder of the division by x^3 + x + 1.
  function [CRC-1:0] crc(input [N-1:0] bits);
    integer k;
    begin
      crc = 0;
      for (k = N - 1; k >= 0; k = k - 1) crc = {crc[1:0], 1'b0} ^ (crc[2] ^ bits[k] ? 3'b011 : 3'b000);
    end
  endfunction

  // Bits of the frame as they are on the line, and the clocks from the start on.
  reg [N-1:0] bits = 0;
  reg [7:0] since = 0;
  wire busy = core_state != IDLE && core_state != REST;
  wire read = core_state == FRAME && core_at == 0;
  always @(posedge clk)
    if (rst) begin
      bits <= 0;
      since <= 0;
    end else begin
      since <= core_state == IDLE ? 1 : since + busy;
      if (read) bits <= {bits[N-2:0], core_line};
      else if (core_state != FRAME && core_state != DONE) bits <= 0;
    end
  wire [7:0] age = since - 1 - HALF;
  wire [3:0] there = N - 1 - core_left;  // bits of the frame that have come
  wire [3:0] behind = there > W ? there - W : 0;  // those of them after the position
  wire [W-1:0] known = there > W ? {W{1'b1}} : (1 << there) - 1;
  wire [W+1:0] covered = bits >> CRC;

  always @* begin
    lemma_state: assert (core_state != 7);
    lemma_begin: assert (core_state == IDLE || core_state >= FRAME || core_state == DONE || (core_check == 0 && core_left == N - 1));
    lemma_waits: assert ((core_state != ANSWER && core_state != START) || (since > 0 && since <= 1 + HALF + WAIT));
    lemma_age: assert (!busy || sample_age == age[5:0]);
    lemma_cds: assert (core_state != CDS || (since > HALF && since + core_at + 2 * HALF * N + 1 <= LONGEST));
    lemma_frame: assert (core_state != FRAME || (since > HALF && since + core_at + 2 * HALF * core_left + 1 <= LONGEST));
    lemma_check: assert ((core_state != FRAME && core_state != DONE) || core_silent || core_check == crc(bits));
    lemma_bits: assert (core_state != FRAME || bits >> there == 0);
    lemma_sample: assert (core_state != FRAME || ((sample ^ (bits >> behind)) & known) == 0);
    lemma_flags: assert (core_state != FRAME || there < W + 2 || core_flags == (bits >> (there - W - 2) & 2'd3));
    lemma_flag: assert (core_state != FRAME || there != W + 1 || core_flags[0] == bits[0]);
    lemma_done: assert (core_state != DONE || core_silent || (sample == bits[N-1:N-W] && core_flags == bits[CRC+1:CRC]));
    pe_time: assert (!busy || since <= LONGEST);
    pe_ends: assert (core_state != DONE || sample_valid);
    pe_event: assert (!sample_ok || (sample_valid && core_state == DONE));
    pe_crc: assert (!sample_ok || bits[CRC-1:0] == ~crc({3'b000, covered}));
    pe_error: assert (!sample_ok || bits[CRC+1]);
    pe_sample: assert (!sample_ok || sample == bits[N-1:N-W]);
  end
endmodule
