// Properties of what follows the position and the velocity, and watches the lines: any inputs, and `rst` at any time.
// Each says what is shown by what was there a clock before. With UPSET nothing is known at first, and what is remembered
// is right as soon as it is `fresh`: the lines of a pair differed, or a program cleared the fault, or armed the index.
module outputs #(
    parameter OPEN = 3,
    parameter MODULUS = 5,
    parameter LIMIT = 5,
    parameter APART = 3,
    parameter PARTED = 16,
    parameter PARTS = 3,
    parameter UPSET = 0
) (
    input clk, input rst, input [1:0] way, input clear, input load, input arm, input level, input ready,
    input [1:0] edges, input valid, input equal, input level_a, input level_b, input decode_error,
    input signed [3:0] value, input signed [3:0] velocity
);
  wire signed [1:0] step = way == 2 ? 0 : way;
  wire [2:0] modulo, parted, probe_time, health;
  wire [1:0] core_rest;
  wire signed [3:0] position, index_position, probe_position, position_compare_position, both_position;
  wire index_valid, homed, probed, probe_valid, over_speed, open, seen, compare, position_compare_valid, both, both_valid;
  wire [7:0] faults;
  wire [15:0] position_compare_count;
  tachometer core (
      .clk(clk), .rst(rst), .modulo_step(step), .modulo_clear(clear), .modulo_count(modulo),
      .parted_step(step), .parted_clear(clear), .parted_count(parted),
      .position_step(step), .position_clear(clear), .position_load(load), .position_value(value),
      .position_position(position),
      .home_level_z(level), .home_ready(ready), .home_position(value), .home_arm(arm), .home_homed(homed),
      .home_index_position(index_position), .home_index_valid(index_valid),
      .probe_level_probe(level), .probe_ready_probe(ready), .probe_step(step), .probe_next_position(value),
      .probe_probe_edges(edges), .probe_probe_arm(arm), .probe_probed(probed), .probe_probe_valid_0(probe_valid),
      .probe_probe_position_0(probe_position), .probe_probe_time_0(probe_time),
      .trip_velocity_valid(valid), .trip_velocity(velocity), .trip_clear(clear), .trip_over_speed(over_speed),
      .open_equal(equal), .open_clear(clear), .open_open(open),
      .watch_level_a(level_a), .watch_level_b(level_b), .watch_ready(ready), .watch_step(step),
      .watch_decode_error(decode_error), .watch_clear(clear), .watch_seen(seen), .watch_health(health),
      .watch_faults(faults),
      .compare_position(value), .compare_step(step), .compare_position_compare(compare), .compare_position_compare_valid(position_compare_valid),
      .compare_position_compare_position(position_compare_position), .compare_position_compare_count(position_compare_count),
      .both_position(value), .both_step(step), .both_moves(load), .both_position_compare(both), .both_position_compare_valid(both_valid),
      .both_position_compare_position(both_position)
  );

  // What was there in the clock before, and what is remembered of all before; after a reset it is as at the begin.
  reg was_reset = 1, fresh_open = !UPSET, fresh_armed = !UPSET, fresh_home = !UPSET;
  reg [1:0] fresh_clocks = UPSET ? 0 : 3;  // the lines are known
  reg cleared = 0, loaded = 0, armed = 0, was_valid = 0, was_over = 0, was_seen = 0, was_probed = 0, was_homed = 0;
  reg level_ = 0, level_a_ = 0, level_b_ = 0, was_a = 0, was_b = 0, rose = 0, waits = 0, taken = 0, turned = 0, turned_ = 0, hit_ = 0;
  reg pulse = 0, pulse_both = 0;
  reg signed [1:0] step_ = 0, late = 0;
  reg signed [3:0] value_ = 0, velocity_ = 0, position_ = 0, index_ = 0, latched = 0, awaited = 1;
  reg [2:0] modulo_ = 0, time_ = 0, since = 7, since_ = 7, health_ = 0;
  reg [7:0] faults_ = 0;
  reg [1:0] number = 0;
  reg [3:0] turn_ = 0;  // PARTS times the counts, modulo PARTED
  reg [2:0] stands = 0;  // clocks since the position was set, in which it did not change; 0: it did
  reg [OPEN:0] history = 0;  // of `equal`, as far back as it was not cleared, the latest clock lowest
  wire hit = step == 1 && value == awaited && number != 2;
  wire turns = ready && (edges[0] && level && !level_ || edges[1] && !level && level_);
  always @(posedge clk) begin
    was_reset <= rst;
    {cleared, loaded, armed, was_valid, was_seen} <= {clear, load, arm, valid, seen};
    {was_over, was_probed, was_homed, modulo_, position_} <= {over_speed, probed, homed, modulo, position};
    {value_, velocity_, index_, latched, time_} <= {value, velocity, index_position, probe_position, probe_time};
    {health_, faults_, level_a_, level_b_} <= {health, faults, level_a, level_b};
    {was_a, was_b} <= {level_a_, level_b_};
    {pulse, pulse_both} <= rst ? 2'b0 : {position_compare_valid, both_valid};
    turn_ <= turn;
    step_ <= rst ? 0 : step;
    late <= rst ? 0 : step_;
    level_ <= !rst && level;
    rose <= !rst && level && !level_ && ready;
    waits <= !rst && (arm || (waits && !rose));
    taken <= !rst && rose && waits;
    {turned, turned_} <= rst ? 2'b0 : {turns, turned};
    since <= rst ? 7 : step != 0 ? 0 : since + (since != 7);
    since_ <= since;
    hit_ <= !rst && hit;
    awaited <= rst ? 1 : hit ? awaited + APART : awaited;
    number <= rst ? 0 : number + hit;
    stands <= rst ? 0 : load ? 1 : stands == 0 || step != 0 || (stands > 1 && value != value_) ? 0 : stands + (stands < 4);
    history <= rst || !equal || clear ? 0 : {history, 1'b1};
    fresh_open <= fresh_open || rst || !equal || clear;
    fresh_clocks <= {fresh_clocks, 1'b1};
    fresh_armed <= fresh_armed || rst || (arm && fresh_clocks[1]);
    fresh_home <= fresh_armed;
  end
  wire [2:0] after = modulo_ == MODULUS - 1 ? 0 : modulo_ + 1, before = modulo_ == 0 ? MODULUS - 1 : modulo_ - 1;
  wire [3:0] turn = restarts ? 0 : (turn_ + PARTED + (late == 1 ? PARTS : late == 0 ? 0 : -PARTS)) % PARTED;
  wire signed [3:0] from = loaded ? value_ : position_;
  wire beyond = was_valid && (velocity_ > LIMIT || velocity_ < -LIMIT);
  wire restarts = was_reset || cleared;
  wire [3:0] core_awaited;
  wire [4:0] core_next;
  wire [2:0] core_since;
  wire [1:0] core_number;
  wire core_armed;
  wire kept = health_ != 0 ? health == health_ : (health != 0) == was_seen;
  always @* begin
    po_modulo: assert (modulo == (restarts ? 0 : late == 1 ? after : late == 0 ? modulo_ : before));
    po_position: assert (position == (restarts ? 4'sd0 : from + late));
    po_trip: assert (over_speed == (!restarts && (was_over || beyond)));
    po_open: assert (!fresh_open || open == (equal && &history[OPEN-1:0] && !history[OPEN]));
    po_health: assert (restarts ? health == 0 : kept);
    po_faults: assert (faults == (restarts ? 0 : faults_ + (was_seen && faults_ != 255)));
    po_line: assert (restarts || health_ != 0 || (health != 1 || level_b_ != was_b) && (health != 2 || level_a_ != was_a));
    po_home: assert (!fresh_home || index_valid == taken);
    po_homed: assert (homed == (!was_reset && !armed && (index_valid || was_homed)));
    po_index: assert (index_position == (was_reset ? 4'sd0 : index_valid ? value_ : index_));
    po_latches: assert (probe_valid == (!was_reset && turned_ && !was_probed));
    po_probed: assert (probed == (!was_reset && (was_probed || turned_) && !armed));
    po_latched: assert (probe_position == (was_reset ? 4'sd0 : probe_valid ? value_ : latched));
    po_since: assert (probe_time == (was_reset ? 0 : probe_valid ? since_ : time_));
    po_pulse: assert (compare == (position_compare_valid || pulse) && both == (both_valid || pulse_both));
    po_place: assert (!position_compare_valid || position_compare_position == value_);
    po_edge: assert (!both_valid || (step_ != 0 && both_position == $signed(value_ - (step_ >>> 1))));
    if (!UPSET) begin
      po_range: assert (modulo < MODULUS && (health[2] ? health == 4 : health != 3));
      po_parted: assert (parted == turn / PARTS);
      po_due: assert (position_compare_valid == hit_ && position_compare_count == number);
      po_aimed: assert (stands < 4 || core_number == (value_ >= 1) + (value_ >= 1 + APART));
      po_grid: assert (!both_valid || both_position == 1 || both_position == 1 + APART);
      // Lemmas: what the induction needs to know of the state.
      lemma_rest: assert (core_rest == turn % PARTS);
      lemma_awaited: assert (core_awaited == awaited);
      lemma_waits: assert (core_armed == waits);
      lemma_since: assert (core_since == since);
      lemma_number: assert (number <= 2 && core_number <= 2 && core_next == 1 + APART * core_number);
    end
  end
endmodule
