// Properties of the master of an encoder with SPI, alone: what it takes of a word, and that each read ends in time.
module spi_read #(
    parameter W = 14,
    parameter HALF = 3,
    parameter SETUP = 3,
    parameter READ = 0,  // core_at as a bit is read
    parameter BYTES = 0,  // it waits between two bytes
    parameter LATE = 1,  // even parity, an error bit, and commands; else ones are odd in both halves
    parameter AT_WIDTH = 3,
    parameter AGE_WIDTH = 8,
    parameter LONGEST = 103
) (
    input clk, input rst, input spi_miso, input start
);
  localparam IDLE = 0, CHOSEN = 1, BIT = 2, DONE = 3;
  wire spi_sck, spi_cs_n, spi_mosi, sample_valid, sample_ok, sample_warning;
  wire [W-1:0] sample;
  wire [AGE_WIDTH-1:0] sample_age;
  wire [1:0] reason;
  tachometer core (
      .clk(clk), .rst(rst), .spi_sck(spi_sck), .spi_cs_n(spi_cs_n), .spi_mosi(spi_mosi), .spi_miso(spi_miso),
      .start(start), .sample(sample), .sample_valid(sample_valid), .sample_age(sample_age), .sample_ok(sample_ok),
      .sample_warning(sample_warning), .reason(reason)
  );
  wire core_line;
  wire [1:0] core_odd;
  wire [2:0] core_state;
  wire [4:0] core_left;
  wire [AT_WIDTH-1:0] core_at;
  wire [14:0] core_word;

  // Bits as they are on the line, and the clocks from the start on.
  reg [15:0] bits = 0;
  reg [7:0] since = 0;
  wire busy = core_state == CHOSEN || core_state == BIT || core_state == DONE;
  wire read = core_state == BIT && core_at == READ;
  wire [4:0] there = 16 - core_left + (core_state == BIT && core_at < READ);
  wire [7:0] left = 2 * HALF * core_left;
  always @(posedge clk)
    if (rst) begin
      bits <= 0;
      since <= 0;
    end else begin
      since <= core_state == IDLE ? 1 : since + busy;
      bits <= core_state == IDLE ? 0 : read ? {bits, core_line} : bits;
    end
  wire odd = ^(bits & 16'haaaa), even = ^(bits & 16'h5555);

  always @* begin
    lemma_state: assert (core_state <= 4);
    lemma_left: assert (!busy || core_left <= 16);
    lemma_chosen: assert (core_state != CHOSEN || core_left == 0 || core_left == 16 || (BYTES && core_left == 8));
    lemma_setup: assert (core_state != CHOSEN ||
        since + core_at + 1 + left + (core_left[4] ? SETUP * (1 + BYTES) : core_left[3] ? SETUP : 0) == LONGEST);
    lemma_bit: assert (core_state != BIT || (core_left > 0 && core_at < 2 * HALF &&
        since + core_at + 1 + left - 2 * HALF + SETUP * (1 + (BYTES && core_left > 8)) == LONGEST));
    lemma_done: assert (core_state != DONE || (core_left == 0 && since == LONGEST));
    lemma_bits: assert (!busy || bits >> there == 0);
    lemma_word: assert (!busy || ((core_word ^ bits) & ((1 << there) - 1) & 15'h7fff) == 0);
    lemma_odd: assert (!busy || core_odd == {odd, even});
    pe_time: assert (!busy || since <= LONGEST);
    pe_ends: assert (core_state != DONE || sample_valid);
    pe_event: assert (!sample_ok || (sample_valid && core_state == DONE));
    pe_check: assert (!sample_ok || (LATE ? odd == even : odd && even));
    pe_sample: assert (!sample_ok || sample == bits[13:14-W]);
  end

  // The command of this frame, and that of the one before, which this one answers.
  generate
    if (LATE) begin : late
      wire core_clears, core_cleared;
      reg [15:0] command = 0, before = 16'hffff;
      always @(posedge clk)
        if (rst) begin
          command <= 0;
          before <= 16'hffff;
        end else begin
          command <= core_state == IDLE ? 0 : read ? {command, spi_mosi} : command;
          if (core_state == DONE) before <= command;
        end
      wire [15:0] due = core_clears ? 16'h4001 : 16'hffff;
      always @* begin
        lemma_command: assert (!busy || command == due >> core_left);
        lemma_before: assert (before == (core_cleared ? 16'h4001 : 16'hffff));
        pe_error: assert (!sample_ok || !bits[14]);
        pe_command: assert (!sample_ok || before == 16'hffff);
      end
    end
  endgenerate
endmodule
