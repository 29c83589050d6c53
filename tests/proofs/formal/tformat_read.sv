// Properties of the master of an encoder with T-format, alone: what it takes of an answer, and that each read ends in
// time.
module tformat_read #(
    parameter W = 3,
    parameter T = 1,  // bits of turns
    parameter N = 11,  // characters
    parameter BITS = 4,  // clocks of a bit
    parameter LAST_START = 14,
    parameter AGE_WIDTH = 9,
    parameter LONGEST = 300
) (
    input clk, input rst, input rs485_rx, input start
);
  localparam IDLE = 0, SEND = 1, WAITS = 2, CHARACTER = 3, DONE = 4, HALF = BITS / 2, TAKEN = 10 * BITS + 1, P = W - T;
  wire rs485_tx, rs485_de, sample_valid, sample_ok, sample_warning;
  wire [W-1:0] sample;
  wire [AGE_WIDTH-1:0] sample_age;
  wire [1:0] reason;
  tachometer core (
      .clk(clk), .rst(rst), .rs485_tx(rs485_tx), .rs485_de(rs485_de), .rs485_rx(rs485_rx), .start(start),
      .sample(sample), .sample_valid(sample_valid), .sample_age(sample_age), .sample_ok(sample_ok),
      .sample_warning(sample_warning), .reason(reason)
  );
  wire core_line, core_silent, core_wrong, core_error;
  wire [2:0] core_state;
  wire [$clog2(BITS)-1:0] core_at;
  wire [3:0] core_place;
  wire [$clog2(8*N+1)-1:0] core_number;
  wire [7:0] core_check;
  wire [AGE_WIDTH-1:0] core_time;

  // Of the answer: the first two characters, the position, the sum of all characters, and whether a start or stop bit
  // was wrong; and the clocks from the start on.
  reg [15:0] head = 0;
  reg [W-1:0] place = 0;
  reg [7:0] sum = 0;
  reg bad = 0;
  reg [AGE_WIDTH:0] since = 0;
  wire answer = core_state == WAITS || core_state == CHARACTER || core_state == DONE;
  wire busy = answer || core_state == SEND;
  wire read = core_state == CHARACTER && core_at == 0;
  always @(posedge clk)
    if (rst || core_state == IDLE) begin
      head <= 0;
      place <= 0;
      sum <= 0;
      bad <= 0;
      since <= !rst;
    end else begin
      since <= since + busy;
      if (read && core_place == 0) bad <= bad | core_line;
      else if (read && core_place == 9) bad <= bad | !core_line;
      else if (read) begin
        sum[core_number[2:0]] <= sum[core_number[2:0]] ^ core_line;
        if (core_number < 16) head[core_number[3:0]] <= core_line;
        if (core_number >= 16 && core_number < 16 + P) place[core_number-16] <= core_line;
        if (core_number >= 48 && core_number < 48 + T) place[core_number-48+P] <= core_line;
      end
    end
  wire [7:0] known = core_number < 8 ? (1 << core_number) - 1 : 8'hff;
  wire [3:0] come = core_number <= 16 ? 0 : core_number < 16 + P ? core_number - 16 : core_number <= 48 ? P :
      core_number < 48 + T ? core_number - 48 + P : W;

  always @* begin
    lemma_state: assert (core_state <= 5);
    lemma_send: assert (core_state != SEND || (core_at < BITS && core_place < 10 && since + core_at == (core_place + 1) * BITS));
    lemma_begin: assert (core_state != SEND || !{head, place, sum, bad, core_number, core_check, core_silent, core_wrong, core_error});
    lemma_time: assert (!answer || since == TAKEN + core_time);
    lemma_waits: assert (core_state != WAITS || (core_number[2:0] == 0 && core_number < 8 * N && !core_silent));
    lemma_number: assert (core_state != CHARACTER || (!core_silent && core_place < 10 &&
        core_number[2:0] == (core_place == 0 || core_place == 9 ? 0 : core_place - 1) &&
        (core_place == 9 ? core_number >= 8 && core_number <= 8 * N : core_number < 8 * N)));
    lemma_at: assert (core_state != CHARACTER || (core_at < (core_place == 0 ? HALF : BITS) &&
        core_time + core_at + 1 <= LAST_START + HALF + core_place * BITS));
    lemma_late: assert (core_state != WAITS || core_time <= LAST_START + 9 * BITS + HALF);
    lemma_done: assert (core_state != DONE || (since <= LONGEST && (core_silent || core_number == 8 * N)));
    lemma_data: assert (!busy || (head >> core_number == 0 && place >> come == 0));
    lemma_check: assert (!answer || core_check == ({sum, sum} >> core_number[2:0] & 8'hff));
    lemma_wrong: assert (!answer || core_wrong == (bad || (head[7:0] ^ 8'h1a) & known));
    lemma_error: assert (!answer || core_error == |(head[15:8] & 8'hd0));
    lemma_sample: assert (!answer || sample >> (W - come) == place);
    pe_time: assert (!busy || since <= LONGEST);
    pe_ends: assert (core_state != DONE || sample_valid);
    pe_event: assert (!sample_ok || (sample_valid && core_state == DONE));
    pe_check: assert (!sample_ok || (sum == 0 && core_number == 8 * N));
    pe_frame: assert (!sample_ok || (!bad && head[7:0] == 8'h1a));
    pe_error: assert (!sample_ok || !(head[15:8] & 8'hd0));
    pe_sample: assert (!sample_ok || sample == place);
  end
endmodule
