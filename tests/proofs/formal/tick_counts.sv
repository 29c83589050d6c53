// Properties of the counts of a tick, of the tracking method: ticks of any length from 2 to LONGEST clocks, any steps, and
// `rst` at any time. The reference adds up at each count, with the place and the kind of its edge from a whole position.
module tick_counts #(
    parameter MOST = 3,
    parameter LONGEST = 9,
    parameter MAX_TICKS = 4,
    parameter NUMBER_BITS = 2,
    parameter TIMES_BITS = 5,
    parameter PLACES_BITS = 5,
    parameter MOVED_BITS = 5,
    parameter LAST_BITS = 4,
    parameter ELAPSED_BITS = 3,
    parameter LENGTH_BITS = 4
) (
    input clk, input rst, input ends, input [1:0] way
);
  localparam A = 8, S = 12;
  // The lines of an encoder never turn both ways at once.
  wire signed [1:0] step = way == 2 ? 0 : way;
  wire [NUMBER_BITS-1:0] number;
  wire [TIMES_BITS-1:0] times;
  wire signed [PLACES_BITS-1:0] places;
  wire [1:0] kind, end_;
  wire down;
  wire [LAST_BITS-1:0] last;
  wire signed [MOVED_BITS-1:0] moved;
  wire [ELAPSED_BITS-1:0] elapsed;
  wire [LENGTH_BITS-1:0] length;
  reg [A-1:0] clocks = 0;  // of this tick, before this one
  wire tick = clocks == LONGEST - 1 || (ends && clocks != 0);
  tachometer core (
      .clk(clk), .rst(rst), .tick(tick), .step(step), .number(number), .times(times), .places(places), .kind(kind),
      .down(down), .last(last), .moved(moved), .\end (end_), .elapsed(elapsed), .length(length)
  );

  // Of each count: its age in clocks, and twice the place of its edge from the begin of the tick; as of the clock before.
  reg fresh = 0, any = 0, backward = 0;
  reg [A-1:0] through = 0, total = 0, since = 0, silent = MAX_TICKS;
  reg [A*MOST-1:0] ages = 0;
  reg signed [S-1:0] spots = 0, way_ = 0;
  reg [1:0] at = 0, of_last = 0;
  reg [S-1:0] sum_ages;
  reg [A*MOST-1:0] older;
  reg bounded;
  integer j;
  always @* begin
    sum_ages = 0;
    bounded = 1;
    for (j = 0; j < MOST; j = j + 1) begin
      older[A*j+:A] = ages[A*j+:A] + 1;
      if (j < total) begin
        sum_ages = sum_ages + ages[A*j+:A];
        if (ages[A*j+:A] >= through) bounded = 0;
      end
    end
    if (spots > $signed({1'b0, total}) * $signed({1'b0, total})) bounded = 0;
    if (spots < -$signed({1'b0, total}) * $signed({1'b0, total})) bounded = 0;
    if (way_ > $signed({1'b0, through}) || way_ < -$signed({1'b0, through})) bounded = 0;
    if (total < MOST && (way_ > $signed({1'b0, total}) || way_ < -$signed({1'b0, total}))) bounded = 0;
  end

  // What must be shown.
  reg [A-1:0] number_ = 0, elapsed_ = MAX_TICKS, length_ = 0, last_ = 0;
  reg [S-1:0] times_ = 0;
  reg signed [S-1:0] places_ = 0, moved_ = 0;
  reg [1:0] kind_ = 0, at_end = 0;
  reg down_ = 0;
  wire count = step != 0;
  wire [A-1:0] before = fresh ? 0 : total;
  wire signed [S-1:0] way_before = fresh ? 0 : way_, spots_before = fresh ? 0 : spots;
  wire taken = count && before < MOST;
  wire [A-1:0] after = before + taken;
  wire signed [S-1:0] way_after = way_before + step, spots_after = spots_before + (taken ? 2 * way_before + step : 0);
  always @(posedge clk)
    if (rst) begin
      {fresh, any, backward, through, total, since, ages, spots, way_, at, of_last, clocks} <= 0;
      {number_, length_, last_, times_, places_, moved_, kind_, at_end, down_} <= 0;
      silent <= MAX_TICKS;
      elapsed_ <= MAX_TICKS;
    end else begin
      clocks <= tick ? 0 : clocks + 1;
      fresh <= tick;
      through <= fresh ? 1 : through + 1;
      at <= at + step;
      way_ <= way_after;
      total <= after;
      ages <= taken ? {older, {A{1'b0}}} : older;
      any <= count || (any && !fresh);
      since <= count ? 0 : since + 1;
      spots <= spots_after;
      if (taken) {of_last, backward} <= {step == 1 ? at : at - 2'd1, step != 1};
      if (tick) begin
        length_ <= clocks + 1;
        {number_, places_, moved_} <= {after, spots_after, way_after};
        elapsed_ <= silent >= MAX_TICKS ? MAX_TICKS : silent + 1;
        silent <= after != 0 ? 0 : silent >= MAX_TICKS ? MAX_TICKS : silent + 1;
      end
      if (fresh) begin
        {times_, at_end} <= {sum_ages, at};
        if (any) {kind_, down_, last_} <= {of_last, backward, since};
      end
    end

  wire [NUMBER_BITS-1:0] core_number;
  wire [TIMES_BITS-1:0] core_times;
  wire signed [PLACES_BITS-1:0] core_places;
  wire signed [MOVED_BITS-1:0] core_moved;
  wire [LAST_BITS-1:0] core_last;
  wire [1:0] core_kind, core_position;
  wire core_down, core_fresh;
  wire [LENGTH_BITS-1:0] core_length;
  always @* begin
    pk_number: assert (number == number_);
    pk_times: assert (times == times_);
    pk_places: assert (places == places_);
    pk_moved: assert (moved == moved_ && end_ == at_end);
    pk_of_count: assert (fresh || number == 0 || (kind == kind_ && down == down_ && last == last_));
    pk_elapsed: assert (elapsed == elapsed_);
    pk_length: assert (length_ == 0 || length == length_);
    lemma_number: assert (core_number == before && total <= MOST && any == (total != 0));
    lemma_shown: assert (!fresh || number == total);
    lemma_times: assert (core_times == sum_ages);
    lemma_places: assert (core_places == spots_before && core_moved == way_before);
    lemma_of_count: assert (!any || (core_kind == of_last && core_down == backward && core_last == since));
    lemma_since: assert (!any || since < through);
    lemma_position: assert (core_position == at && core_fresh == fresh);
    lemma_clocks: assert (clocks < LONGEST && core_length == clocks + 1);
    lemma_through: assert (fresh ? clocks == 0 && through <= LONGEST : through == clocks);
    lemma_bounded: assert (bounded);
    lemma_silent: assert (number_ != 0 ? silent == 0 : silent == elapsed_);
    lemma_elapsed: assert (elapsed_ != 0 && elapsed_ <= MAX_TICKS);
  end
endmodule
