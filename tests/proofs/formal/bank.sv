  // Registers behind a bus, of a core of the M method: included by the checkers of the buses. What reads must show follows
  // from the ports of the core and from the accesses that reach the registers.
  localparam C = COUNT_WIDTH, V = COUNT_WIDTH + FRAC_BITS;
  wire tick, velocity_valid, forced, standstill, overflow, decode_error;
  wire signed [C-1:0] pulse_count;
  wire signed [V-1:0] velocity;
  wire [1:0] interval;
  wire signed [7:0] position;

  wire core_read, core_write, core_clear, core_hold, core_error, core_waits;
  wire [3:0] core_address;
  wire [31:0] core_write_data, core_read_data;
  wire signed [7:0] core_at_tick;
  wire core_left;
  wire signed [V-1:0] core_velocity;
  wire [1:0] core_interval;
  wire signed [C-1:0] core_pulse_count;
  wire signed [7:0] core_position;
  wire core_updated, core_forced, core_overflow, core_standstill;
  wire [7:0] core_errors, core_overflows, core_lost;

  localparam CONTROL = 2, COUNTERS = 3, VELOCITY = 4, REGISTERS = 9;
  wire writes_control = core_write && core_address == CONTROL;
  wire clears = writes_control && core_write_data[0];
  wire captures = capture || core_read && core_address == VELOCITY && !hold;

  // What was shown in the clock of the last capture, and what has been since.
  reg signed [V-1:0] kept_velocity = 0;
  reg [1:0] kept_interval = 0;
  reg signed [C-1:0] kept_pulse_count = 0;
  reg signed [7:0] kept_position = 0;
  reg [3:0] kept_flags = 0;
  reg signed [7:0] last_at_tick = 0;
  reg second = 0;  // of the two clocks of a tick
  wire signed [7:0] at_tick = tick ? position : last_at_tick;
  reg hold = 0, waits = 0;
  reg [7:0] errors = 0, overflows = 0, lost = 0;
  // The access of the clock before.
  reg was_read = 0, was_refused = 0;
  reg [3:0] was_address = 0;
  always @(posedge clk)
    if (rst) begin
      {kept_velocity, kept_interval, kept_pulse_count, kept_position, kept_flags} <= 0;
      {hold, waits, errors, overflows, lost, last_at_tick, second, was_read, was_refused, was_address} <= 0;
    end else begin
      if (captures) begin
        kept_velocity <= velocity;
        kept_interval <= interval;
        kept_pulse_count <= pulse_count;
        kept_position <= at_tick;
        kept_flags <= {standstill, overflow, forced, waits || velocity_valid};
      end
      waits <= (waits || velocity_valid) && !captures;
      if (writes_control) hold <= core_write_data[1];
      errors <= clears ? 0 : errors + (decode_error && errors != 255);
      overflows <= clears ? 0 : overflows + (tick && overflow && overflows != 255);
      lost <= clears ? 0 : lost + (waits && velocity_valid && lost != 255);
      last_at_tick <= at_tick;
      second <= !second;
      was_read <= core_read;
      was_refused <= core_write && core_address != CONTROL || core_read && core_address >= REGISTERS;
      was_address <= core_address;
    end

  reg [31:0] word;
  always @*
    case (was_address)
      0: word = IDENTIFICATION;
      1: word = CONFIGURATION;
      CONTROL: word = {hold, 1'b0};
      COUNTERS: word = {lost, overflows, errors};
      VELOCITY: word = {{32 - V{kept_velocity[V-1]}}, kept_velocity};
      5: word = kept_flags;
      6: word = kept_interval;
      7: word = {{32 - C{kept_pulse_count[C-1]}}, kept_pulse_count};
      8: word = {{24{kept_position[7]}}, kept_position};
      default: word = 0;
    endcase
  always @* begin
    lemma_waits: assert (core_waits == waits);
    lemma_left: assert (core_left == second);
    lemma_tick: assert (core_at_tick == at_tick);
    pb_snapshot: assert (core_velocity == kept_velocity && core_interval == kept_interval
        && core_pulse_count == kept_pulse_count && core_position == kept_position
        && {core_standstill, core_overflow, core_forced, core_updated} == kept_flags);
    pb_write: assert (core_hold == hold && core_clear == clears
        && {core_lost, core_overflows, core_errors} == {lost, overflows, errors});
    pb_read: assert (core_read_data == (was_read ? word : 0));
    pb_error: assert (core_error == was_refused);
  end
