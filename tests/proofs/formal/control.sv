// Properties of the control loop, alone: any inputs, control ticks at any time after the one before is done. The reference
// is computed from what is there at a control tick, in W bits: that the core is equal to it shows that nothing wraps.
`ifndef CONTROL
`define CONTROL control
`endif
module `CONTROL #(
    parameter W = 10,
    parameter VELOCITY_WIDTH = 3, V = 3, EXTRA = 1, P = 3, LONGEST = 3, N_WIDTH = 2, LIMIT = 5, GUARD = 4,
    parameter POSITION_WIDTH = 2, FRACTION = 8, COMMAND_WIDTH = 4, COMMAND_BITS = 1, ACCELERATION_WIDTH = 3,
    parameter Y_WIDTH = 4, W_WIDTH = 6, CURRENT_WIDTH = 4, SUM_WIDTH = 5, WORD_WIDTH = 12, TOTAL_WIDTH = 14,
    parameter MOST_Y = 6, MOST_Z = 20, MOST_ERROR = 63,
    // Of each term a byte for every n, from 0 on, and how far its words are shifted.
    parameter FILTERS = 0, OBSERVERS = 0, CURRENTS = 0, POSITIONS = 0, VELOCITIES = 0, ACCELERATIONS = 0,
    parameter DISTURBANCES = 0, GAIN_WIDTH = 1, GAIN_SHIFT = 0, LIMIT_WIDTH = 1,
    parameter S_CURRENT = 0, S_POSITION = 0, S_VELOCITY = 0, S_ACCELERATION = 0, S_DISTURBANCE = 0
) (
    input clk, input rst, input wants, input update, input measured, input signed [VELOCITY_WIDTH-1:0] any_velocity, input enable,
    input signed [POSITION_WIDTH-1:0] position, input signed [POSITION_WIDTH+FRACTION-1:0] command_position,
    input signed [COMMAND_WIDTH-1:0] command_velocity, input signed [ACCELERATION_WIDTH-1:0] command_acceleration
`ifdef GAINS
    , input [GAIN_WIDTH-1:0] any_position, any_velocity_gain, any_acceleration, any_disturbance,
    input [LIMIT_WIDTH-1:0] any_limit
`endif
);
  localparam EACH = 6, TERMS = 7, FINISH = EACH * TERMS, DONE = FINISH + 2;
  // With a sign, which parameters from outside do not have.
  localparam signed [W-1:0] most_v = V, most_y = MOST_Y, most_z = MOST_Z, most_error = MOST_ERROR, most_limit = LIMIT;
  // No velocity is greater than the tachometer can measure.
  wire signed [VELOCITY_WIDTH-1:0] velocity = any_velocity > most_v ? most_v : any_velocity < -most_v ? -most_v : any_velocity;
  reg [5:0] since = 0;  // clocks since the control tick; 0: at rest
  wire tick = wants && since == 0 && !rst;
  wire valid, saturated;
  wire signed [CURRENT_WIDTH-1:0] current;
  wire signed [Y_WIDTH-1:0] y;
  wire signed [W_WIDTH-1:0] w;
`ifdef GAINS
  // Any gains and any limit, which do not change while the program runs.
  reg [4*GAIN_WIDTH+LIMIT_WIDTH-1:0] t_gains = 0;
  wire [4*GAIN_WIDTH+LIMIT_WIDTH-1:0] gains =
      since == 0 ? {any_position, any_velocity_gain, any_acceleration, any_disturbance, any_limit} : t_gains;
  always @(posedge clk) t_gains <= gains;
  wire [GAIN_WIDTH-1:0] gain_position, gain_velocity, gain_acceleration, gain_disturbance;
  wire [LIMIT_WIDTH-1:0] current_limit;
  assign {gain_position, gain_velocity, gain_acceleration, gain_disturbance, current_limit} = gains;
  wire signed [W-1:0] x_limit = $signed({1'b0, current_limit});
  wire signed [W-1:0] limit = x_limit > most_limit ? most_limit : x_limit;
  wire [8:0] positions = gain_position << GAIN_SHIFT, velocities = gain_velocity << GAIN_SHIFT;
  wire [8:0] accelerations = gain_acceleration << GAIN_SHIFT, disturbances = gain_disturbance << GAIN_SHIFT;
`else
  wire signed [W-1:0] limit = most_limit;
  wire [8:0] positions = POSITIONS, velocities = VELOCITIES, accelerations = ACCELERATIONS, disturbances = DISTURBANCES;
`endif
  tachometer core (
`ifdef GAINS
      .gain_position(gain_position), .gain_velocity(gain_velocity), .gain_acceleration(gain_acceleration),
      .gain_disturbance(gain_disturbance), .current_limit(current_limit),
`endif
      .clk(clk), .rst(rst), .tick(tick), .update(update), .measured(measured), .velocity(velocity), .enable(enable), .position(position),
      .command_position(command_position), .command_velocity(command_velocity),
      .command_acceleration(command_acceleration), .valid(valid), .current(current), .saturated(saturated), .y(y), .w(w)
  );
  // What the core has; the proof connects these wires.
  wire core_due, core_again, core_subtract, core_start, core_started, core_multiplied, core_done, core_finish, core_limit;
  wire [2:0] core_term;
  wire [N_WIDTH-1:0] core_n;
  wire signed [SUM_WIDTH-1:0] core_sum;
  wire signed [VELOCITY_WIDTH-1:0] core_held;
  wire signed [WORD_WIDTH-1:0] core_word;
  wire signed [TOTAL_WIDTH-1:0] core_total;
  wire core_enabled, core_is_due;
  wire [LIMIT_WIDTH-1:0] core_most;
  wire signed [COMMAND_WIDTH-1:0] core_velocity;
  wire signed [ACCELERATION_WIDTH-1:0] core_acceleration;

  // What there is at a control tick.
  reg t_due = 0, t_enable = 0;
  reg [N_WIDTH-1:0] t_n = 0;
  reg signed [SUM_WIDTH-1:0] t_sum = 0;
  reg signed [VELOCITY_WIDTH-1:0] t_held = 0;
  reg signed [Y_WIDTH-1:0] t_y = 0;
  reg signed [W_WIDTH-1:0] t_w = 0;
  reg signed [POSITION_WIDTH+FRACTION-1:0] t_error = 0;
  reg signed [COMMAND_WIDTH-1:0] t_velocity = 0;
  reg signed [ACCELERATION_WIDTH-1:0] t_acceleration = 0;
  wire signed [W-1:0] x_position = position;
  wire signed [POSITION_WIDTH+FRACTION-1:0] error = command_position - (x_position <<< FRACTION);
  always @(posedge clk) begin
    if (tick) begin
      t_due <= core_due;
      t_enable <= enable;
      t_n <= core_n;
      t_sum <= core_sum;
      t_held <= core_held;
      t_y <= y;
      t_w <= w;
      t_error <= error;
      t_velocity <= command_velocity;
      t_acceleration <= command_acceleration;
    end
    since <= rst || since == DONE ? 0 : tick ? 1 : since ? since + 1 : 0;
  end

  function signed [W-1:0] product(input signed [W-1:0] word, input signed [8:0] factor);
    product = (word * factor + (1 <<< (P - 1))) >>> P;
  endfunction
  function signed [8:0] byte_of(input [31:0] bytes, input [1:0] n);
    byte_of = (bytes >> (8 * n)) & 255;
  endfunction
  // In this order.
  wire signed [W-1:0] x_held = t_held, x_sum = t_sum, x_velocity = t_velocity, x_acceleration = t_acceleration;
  wire signed [W-1:0] d0 = (x_held <<< EXTRA) - t_y;
  wire signed [W-1:0] p0 = product(d0, byte_of(FILTERS, t_n));
  wire signed [W-1:0] y1 = t_due ? t_y + p0 : t_y, w1 = t_due ? t_w - p0 : t_w;
  wire signed [W-1:0] p1 = product(w1, byte_of(OBSERVERS, t_n));
  wire signed [W-1:0] w2 = t_due ? w1 - p1 : w1;
  wire signed [W-1:0] d2 = x_sum <<< S_CURRENT;
  wire signed [W-1:0] w3 = t_due ? w2 + product(d2, byte_of(CURRENTS, t_n)) : w2;
  wire signed [W-1:0] held = t_error > most_error ? most_error : t_error < -most_error ? -most_error : t_error;
  wire signed [W-1:0] d3 = held <<< S_POSITION;
  wire signed [W-1:0] sum3 = (1 <<< (GUARD - 1)) + product(d3, positions);
  wire signed [W-1:0] d4 = ((x_velocity <<< (EXTRA - COMMAND_BITS)) - y1) <<< S_VELOCITY;
  wire signed [W-1:0] sum4 = sum3 + product(d4, velocities);
  wire signed [W-1:0] d5 = x_acceleration <<< S_ACCELERATION;
  wire signed [W-1:0] sum5 = sum4 + product(d5, accelerations);
  wire signed [W-1:0] d6 = w3 <<< S_DISTURBANCE;
  wire signed [W-1:0] sum6 = sum5 + product(d6, disturbances);
  wire signed [W-1:0] wanted = sum6 >>> GUARD;
  wire signed [W-1:0] limited = wanted > limit ? limit : wanted < -limit ? -limit : wanted;
  wire signed [W-1:0] next_current = t_enable ? limited : 0;

  // Where the program is.
  wire [2:0] term = since / EACH;
  wire [2:0] step = since % EACH;
  wire runs = since != 0 && since < FINISH;
  wire signed [W-1:0] word =
      term == 0 ? d0 : term == 1 ? w1 : term == 2 ? d2 : term == 3 ? d3 : term == 4 ? d4 : term == 5 ? d5 : d6;
  wire signed [W-1:0] z = y + w, t_z = t_y + t_w;
  reg [N_WIDTH:0] n = 0;
  reg signed [W-1:0] sum = 0;
  always @(posedge clk)
    if (rst || (since == EACH * 3 - 1 && t_due)) begin
      n <= 0;
      sum <= 0;
    end else if (since == DONE) begin
      n <= n + 1;
      sum <= sum + current;
    end

  always @(posedge clk) begin
    // The program, step by step.
    lemma_again: assert (core_again == (runs && step == 0));
    lemma_subtract: assert (core_subtract == (runs && step == 1));
    lemma_start: assert (core_start == (runs && step == 2));
    lemma_started: assert (core_started == (runs && step == 3));
    lemma_multiplied: assert (core_multiplied == (runs && step == 4));
    lemma_done: assert (core_done == (runs && step == 5));
    lemma_finish: assert (core_finish == (since == FINISH));
    lemma_limit: assert (core_limit == (since == FINISH + 1));
    lemma_term: assert (core_term == (since <= FINISH ? term : 0));
    lemma_since: assert (since <= DONE);
    // What is taken at a control tick.
    lemma_taken: assert (since == 0 || (t_held <= most_v && t_held >= -most_v && t_y <= most_y && t_y >= -most_y));
    lemma_z: assert (since == 0 || (t_z <= most_z && t_z >= -most_z));
    lemma_sum: assert (since == 0 || (t_sum <= $signed({1'b0, t_n}) * most_limit && t_sum >= -$signed({1'b0, t_n}) * most_limit));
    lemma_due: assert (since == 0 || t_n < LONGEST || t_due);
    lemma_commands: assert (since == 0 || (core_velocity == t_velocity && core_acceleration == t_acceleration));
    lemma_flags: assert (since == 0 || (core_enabled == t_enable && core_is_due == t_due));
`ifdef GAINS
    pc_limit: assert (since < 2 || core_most == limit);
`endif
    lemma_held: assert (core_held <= most_v && core_held >= -most_v);
    // The words, and what becomes of them.
    pc_word: assert (!runs || step < 2 || core_word == word);
    pc_state: assert (
        y <= most_y && y >= -most_y && z <= most_z && z >= -most_z &&
        (since == 0 ||
            (y == (since < EACH ? t_y : y1) &&
             w == (since < EACH ? t_w : since < EACH * 2 ? w1 : since < EACH * 3 ? w2 : w3))));
    pc_total: assert (
        since == 0 || core_total == (
            since < EACH * 4 ? t_error : since < EACH * 5 ? sum3 : since < EACH * 6 ? sum4 : since < FINISH ? sum5 : sum6));
    // Within its limit at all times, and at the end what the equations say.
    pc_current: assert (
        valid == (since == DONE) && current <= most_limit && current >= -most_limit &&
        (since != DONE || (current == next_current && saturated == (t_enable && wanted != limited))));
    // Whatever has come.
    pc_n: assert (core_n == n && n <= LONGEST);
    lemma_total: assert (core_sum == sum && sum <= $signed({1'b0, n}) * most_limit && sum >= -$signed({1'b0, n}) * most_limit);
    lemma_window: assert (since == 0 || (since < EACH * 3 ? n == t_n && sum == t_sum : t_due ? n == 0 && sum == 0 : n == t_n && sum == t_sum));
  end
endmodule
