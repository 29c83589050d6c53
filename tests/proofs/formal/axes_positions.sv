// Positions of many axes: each count that is handed over is in the position of its axis at its tick, and in no other.
module axes_positions #(
    parameter AXES = 2,
    parameter SLOTS = 4,
    parameter T = 20,             // tick_cycles
    parameter TURN = 8,           // turn_cycles
    parameter MAX_COUNT = 1,
    parameter COUNT_WIDTH = 4,    // of what is handed over
    parameter PULSE_WIDTH = 2,
    parameter POSITION_WIDTH = 8,
    parameter AXIS_WIDTH = 1
) (
    input clk, input rst, input signed [COUNT_WIDTH-1:0] count
);
  localparam C = COUNT_WIDTH, P = POSITION_WIDTH, ROUNDS = T / SLOTS;
  wire tick, overflow;
  wire [AXIS_WIDTH-1:0] axis;
  wire signed [PULSE_WIDTH-1:0] pulse_count;
  wire signed [P-1:0] position;

  // The counts of the axes come in the last round of a tick.
  reg [$clog2(T)-1:0] clock = 0;
  wire complete = clock >= T - SLOTS;
  wire [$clog2(SLOTS)-1:0] slot = clock - (T - SLOTS);
  reg begun = 0;  // after reset the turns clear the memory, without counts
  always @(posedge clk) begin
    clock <= rst || clock == T - 1 ? 0 : clock + 1;
    begun <= !rst && (begun || complete);
  end
  always @* assume (count <= ROUNDS && -count <= ROUNDS);
  tachometer core (
      .clk(clk), .rst(rst), .complete(complete), .slot(slot), .count(count), .tick(tick), .axis(axis),
      .pulse_count(pulse_count), .overflow(overflow), .position(position)
  );

  wire [AXES-1:0] wrong, lost, early;
  genvar k;
  generate
    for (k = 0; k < AXES; k = k + 1) begin : own
      reg signed [P-1:0] total = 0;
      reg signed [C-1:0] latest = 0;
      reg waits = 0;  // to be shown
      wire mine = complete && slot == k, shown = tick && axis == k;
      wire signed [C-1:0] held = latest > MAX_COUNT ? MAX_COUNT : latest < -MAX_COUNT ? -MAX_COUNT : latest;
      always @(posedge clk) begin
        if (rst) {total, latest, waits} <= 0;
        else if (mine) begin
          total <= total + count;
          latest <= count;
          waits <= 1;
        end else if (shown) waits <= 0;
      end
      assign wrong[k] = shown && (position != total || pulse_count != held || overflow != (held != latest));
      assign early[k] = !begun && (total != 0 || latest != 0 || waits);
      assign lost[k] = (mine && waits) || (shown && !waits);
    end
  endgenerate

  // Lemmas: whose turn it is follows from the clock.
  wire [TURN-1:0] core_step;
  wire [AXIS_WIDTH-1:0] core_axis;
  wire core_clears;
  wire [$clog2(T):0] late = clock + SLOTS - 1;
  wire [$clog2(T):0] since = !begun ? clock : late >= T ? late - T : late;
  reg turns = 1;
  reg [$clog2(TURN)-1:0] phase = 0;
  reg [AXIS_WIDTH-1:0] turn = 0;
  always @(posedge clk) begin
    if (rst || (complete && slot == 0)) {turns, phase, turn} <= {1'b1, {$clog2(TURN) + AXIS_WIDTH{1'b0}}};
    else if (turns) begin
      phase <= phase == TURN - 1 ? 0 : phase + 1;
      if (phase == TURN - 1) {turns, turn} <= turn == AXES - 1 ? 0 : {1'b1, turn + 1'b1};
    end
  end
  wire [TURN-1:0] step = turns ? 1 << phase : 0;
  always @* begin
    px_position: assert (wrong == 0);
    px_once: assert (lost == 0);
    lemma_clock: assert (clock < T && (begun || clock <= T - SLOTS));
    lemma_turn: assert (turns ? since == turn * TURN + phase && phase < TURN && turn < AXES
        : since >= AXES * TURN && phase == 0 && turn == 0);
    lemma_early: assert (early == 0);
    lemma_step: assert (core_step == step && core_axis == turn);
    lemma_clears: assert (core_clears == (!begun && turns));
  end
endmodule
