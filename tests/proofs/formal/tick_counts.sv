// Properties of the counts of a tick, of the tracking method: ticks of any length from 2 to LONGEST clocks, any steps, and
// `tracks` and `rst` at any time. The reference has each count of the open tick with its age and its place.
module tick_counts #(
    parameter MAX_COUNT = 3,
    parameter LONGEST = 9,
    parameter MAX_TICKS = 4,
    parameter NUMBER_BITS = 2,
    parameter TIMES_BITS = 5,
    parameter PLACES_BITS = 5,
    parameter ELAPSED_BITS = 3,
    parameter LENGTH_BITS = 4
) (
    input clk, input rst, input ends, input [1:0] way, input tracks
);
  localparam N = MAX_COUNT, A = 8, S = 12;
  // The lines of an encoder never turn both ways at once.
  wire signed [1:0] step = way == 2 ? 0 : way;
  wire [NUMBER_BITS-1:0] number;
  wire [TIMES_BITS-1:0] times;
  wire signed [PLACES_BITS-1:0] places;
  wire [ELAPSED_BITS-1:0] elapsed;
  wire [LENGTH_BITS-1:0] length;
  wire counted, quiet;
  reg [A-1:0] clocks = 0;  // of this tick, before this one
  wire tick = clocks == LONGEST - 1 || (ends && clocks != 0);
  tachometer core (
      .clk(clk), .rst(rst), .tick(tick), .step(step), .tracks(tracks), .number(number), .times(times), .places(places),
      .elapsed(elapsed), .counted(counted), .quiet(quiet), .length(length)
  );

  // The counts until the clock before this one, the newest first, and their number, at most one more than N.
  reg fresh = 0;
  reg [A-1:0] through = 0, total = 0;
  reg [A*N-1:0] ages = 0;
  reg [S*N-1:0] spots = 0;
  reg alone = 1;
  reg [A-1:0] silent = MAX_TICKS;
  wire many = total > N;
  wire [A-1:0] used = alone || many ? total != 0 : total;
  reg [S-1:0] sum_ages;
  reg signed [S-1:0] sum_spots;
  reg [A*N-1:0] older;
  reg [S*N-1:0] moved;
  reg [A-1:0] age;
  reg signed [S-1:0] spot;
  reg bounded;
  integer j;
  always @* begin
    {sum_ages, sum_spots} = 0;
    bounded = 1;
    for (j = 0; j < N; j = j + 1) begin
      age = ages[A*j+:A];
      spot = spots[S*j+:S];
      older[A*j+:A] = age + 1;
      moved[S*j+:S] = spot - 2 * step;
      if (j < total && (age >= through || spot > 2 * j + 1 || spot < -2 * j - 1)) bounded = 0;
      if (j < used) begin
        sum_ages = sum_ages + age;
        sum_spots = sum_spots + spot;
      end
    end
  end

  // What must be shown.
  reg [A-1:0] number_ = 0, elapsed_ = MAX_TICKS, length_ = 0;
  reg [S-1:0] times_ = 0;
  reg signed [S-1:0] places_ = 0;
  reg counted_ = 0;
  wire count = step != 0;
  wire signed [S-1:0] minus = -step;
  wire [A-1:0] others = fresh ? 0 : total;
  always @(posedge clk)
    if (rst) begin
      {fresh, through, total, ages, spots, clocks, number_, length_, times_, places_, counted_} <= 0;
      alone <= 1;
      silent <= MAX_TICKS;
      elapsed_ <= MAX_TICKS;
    end else begin
      clocks <= tick ? 0 : clocks + 1;
      fresh <= tick;
      through <= fresh ? 1 : through + 1;
      total <= count && others <= N ? others + 1 : others;
      ages <= count ? {older, {A{1'b0}}} : older;
      spots <= count ? {moved, minus} : moved;
      if (tick) length_ <= clocks + 1;
      if (fresh) begin
        {number_, times_, places_, counted_} <= {used, sum_ages, sum_spots, total != 0};
        alone <= total == 0 || !tracks;
        elapsed_ <= silent >= MAX_TICKS ? MAX_TICKS : silent + 1;
        silent <= total != 0 ? 0 : silent >= MAX_TICKS ? MAX_TICKS : silent + 1;
      end
    end

  wire [NUMBER_BITS-1:0] core_number;
  wire [TIMES_BITS-1:0] core_times;
  wire signed [PLACES_BITS-1:0] core_places;
  wire core_alone, core_fresh;
  wire [LENGTH_BITS-1:0] core_length;
  always @* begin
    pk_number: assert (number == number_ && counted == counted_);
    pk_times: assert (times == times_);
    pk_places: assert (places == places_);
    pk_elapsed: assert (elapsed == elapsed_ && quiet == (elapsed_ == MAX_TICKS));
    pk_length: assert (length == length_);
    lemma_number: assert (core_number == used && total <= N + 1);
    lemma_times: assert (core_times == sum_ages);
    lemma_places: assert (core_places == sum_spots);
    lemma_alone: assert (core_alone == (alone || many) && core_fresh == fresh);
    lemma_clocks: assert (clocks < LONGEST && core_length == clocks + 1);
    lemma_through: assert (fresh ? clocks == 0 && through <= LONGEST : through == clocks);
    lemma_bounded: assert (bounded);
    lemma_silent: assert (counted_ ? silent == 0 : silent == elapsed_);
    lemma_elapsed: assert (elapsed_ != 0 && elapsed_ <= MAX_TICKS);
  end
endmodule
