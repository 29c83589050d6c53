// Properties of the methods that divide counts by time: from the ticks and steps to the updates at the ports, by the
// rules of docs/concepts/timed.md. The reference knows the clocks since the last count, and what was asked of a division, not how
// it is done. `rst` may come at any time.
// core_* show signals of the core to the lemmas, and its steps to the reference; prove.py connects them.
module timed #(
    parameter MT = 0,             // M/T and not T
    parameter LATTICE = 0,        // timer periods are ticks
    parameter T = 4,              // tick_cycles
    parameter COUNT_WIDTH = 3,
    parameter MAX_COUNT = 2,
    parameter MAX_VELOCITY = 2,   // in counts per tick
    parameter VELOCITY_WIDTH = 7,
    parameter MAX_TICKS = 4,
    parameter MAX_PERIODS = 16,   // timer periods in the maximum time
    parameter MIN_PERIODS = 4,    // M/T: in T_c
    parameter CYCLE = 1,          // M/T: counts in a cycle that a window completes; 1: none
    parameter MAX_QUOTIENT = 4,
    parameter SATURATES = 1,
    parameter FLAGS = 1,          // there is an out_of_range
    parameter INTEGER_BITS = 3,   // of any quotient of half counts
    parameter DIVIDEND_DIGITS = 1,  // of the dividend, in a register of their own
    parameter TRAVELLED_WIDTH = 8,  // bits of the way of an M/T window
    parameter QUOTIENT_BITS = 6,  // that the divider makes after the sign
    parameter INTERVAL_WIDTH = 5,
    parameter FRAC_BITS = 4,
    parameter DIVISION_CLOCKS = 11,
    parameter UPSET = 0,          // when a silence or a window is over and a division may begin is taken from the core
    parameter SETTLED = -1        // clocks after which a division has begun after an upset; -1: any has
) (
    input clk, input rst, input a, input b
);
  localparam V = VELOCITY_WIDTH, I = INTERVAL_WIDTH, Q = INTEGER_BITS, N = QUOTIENT_BITS, W = 8;
  localparam P = LATTICE ? 1 : T, B = DIVISION_CLOCKS, LONG = MAX_PERIODS * (LATTICE ? T : 1), PHASES = LATTICE ? T : 1;
  localparam PATIENCE = MIN_PERIODS * (CYCLE > 1 ? 2 : 1);  // timer periods after which any count closes a window
  wire tick, velocity_valid, forced, standstill;
  wire signed [COUNT_WIDTH-1:0] pulse_count;
  wire signed [V-1:0] velocity;
  wire [I-1:0] interval;
  tachometer core (
      .clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .pulse_count(pulse_count), .velocity(velocity),
      .velocity_valid(velocity_valid), .interval(interval), .forced(forced), .standstill(standstill)
  );
  wire core_running, core_done, core_measuring, core_forced, core_opened, core_nearer;
  wire signed [$clog2(MAX_TICKS - 1):0] core_empty;
  wire core_rests, core_silent;
  wire core_negative, core_ticked, core_count, core_overdue, core_ends, core_decays, core_start;
  wire signed [1:0] core_step;
  wire [$clog2(MAX_PERIODS+1)-1:0] core_age;
  wire signed [I:0] core_remainder;
  wire [DIVIDEND_DIGITS-1:0] core_digits;
  wire [N:0] core_copy;
  wire signed [$clog2(N):0] core_steps;
  wire [I-1:0] core_by;

  // The port that is not always there.
  wire beyond;
  generate
    if (FLAGS) begin : flagged
      wire out_of_range;
      assign beyond = out_of_range != 0;
    end else assign beyond = 0;
  endgenerate

  wire rests, rested;
  wire [31:0] quiet;
  standstill #(MAX_TICKS, COUNT_WIDTH) rest (clk, rst, tick, pulse_count, rests, rested, quiet);

  // What a timer period counted, as late as `tick`.
  wire moved, back;
  delay #(2, 2) delayed_steps (clk, rst, {core_step != 0, core_step < 0}, {moved, back});
  wire period = LATTICE ? tick : 1;
  wire signed [COUNT_WIDTH-1:0] size = LATTICE ? pulse_count : !moved ? 0 : back ? -1 : 1;
  wire count = period && size != 0, negative = size < 0;
  wire many = LATTICE && !MT && (size > 1 || size < -1);

  // Clocks since the last count, after reset as if for ever; timer periods since the last count or forced 0.
  reg [W-1:0] idle = LONG + B, age = 1, length = 1;
  wire [W-1:0] waited = UPSET ? core_age : age;
  wire late;
  reg was_negative = 0;
  // The core's sign is that of this count already, where times are counted in clocks.
  reg core_before = 0;
  always @(posedge clk) core_before <= !rst && core_negative;
  wire last_negative = UPSET ? (LATTICE ? core_negative : core_before) : was_negative;
  wire opened = idle < LONG;
  wire overdue = period && !count && waited == MAX_PERIODS;
  always @(posedge clk)
    if (rst) begin
      idle <= LONG + B;
      age <= 1;
      was_negative <= 0;
    end else begin
      idle <= count ? 0 : idle < LONG + B ? idle + 1 : LONG + B;
      if (period) age <= count || overdue ? 1 : age + 1;
      was_negative <= count ? negative : last_negative;
    end

  // Whether a count came since the last tick. On the lattice only ticks have counts.
  reg came = 0;
  wire shown_came, seen = LATTICE ? 0 : UPSET ? shown_came : came;
  always @(posedge clk) came <= !rst && !tick && (count || seen);

  // The window of M/T: its length, and what it has travelled so far, in counts.
  reg signed [W-1:0] travelled = 0;
  wire signed [W-1:0] turned = negative == last_negative ? 0 : negative ? 1 : -1;
  wire signed [W-1:0] pair = MT && LATTICE ? size + turned : negative != last_negative ? 0 : negative ? -1 : 1;
  wire signed [W-1:0] way = travelled + pair;
  wire shown_within, shown_waived;
  reg turned_back = 0;  // within the window
  wire within = UPSET ? shown_within : (way & (CYCLE - 1)) != 0 && (way > CYCLE || way < -CYCLE);
  wire waived = UPSET ? shown_waived : turned_back || length > PATIENCE;
  wire waits = CYCLE > 1 && within && !waived && negative == last_negative;
  wire closes = MT && count && opened && late && !waits;
  always @(posedge clk)
    if (rst) begin
      travelled <= 0;
      length <= 1;
      turned_back <= 0;
    end else begin
      if (count) turned_back <= !closes && opened && (turned_back || negative != last_negative);
      if (period) length <= closes || !opened || overdue ? 1 : length + 1;
      if (count) travelled <= closes || !opened ? 0 : travelled + pair;
    end

  // The division under way: clocks since it began, whether it is of a measurement, its distance in half counts, its time.
  reg [4:0] since = 0;
  reg measuring = 0, silent = 0, many_now = 0;
  reg signed [I+Q:0] distance = 0;
  reg [I-1:0] times = 1;
  wire free = UPSET ? !core_measuring || !core_running : since == 0 || since == B || !measuring;
  wire idles = UPSET ? !(core_running || core_done) : since == 0;
  wire measured = MT ? closes : count && free && (opened || many);
  wire decays = tick && !count && !seen && !overdue && idles;
  wire signed [W-1:0] pairs = MT ? travelled + pair : many ? (negative ? -1 : 1) : pair;
  always @(posedge clk)
    if (rst) since <= 0;
    else begin
      since <= overdue || measured || decays ? 1 : since == 0 || since == B ? 0 : since + 1;
      if (overdue || measured || decays) begin
        measuring <= overdue || measured;
        silent <= !count;
        many_now <= many;
        distance <= overdue ? 0 : measured ? 2 * P * pairs : velocity < 0 ? -3 * P : 3 * P;
        times <= measured ? (MT ? length : many ? 1 : age) : age;
      end
    end

  // The one that was due in the last clock, and what was shown before.
  reg due = 0, due_measuring = 0, due_silent = 0, due_many = 0;
  reg signed [I+Q:0] due_distance = 0;
  reg [I-1:0] due_times = 1;
  reg [V+I+1:0] held = 0;
  reg signed [V-1:0] past = 0;
  reg [4:0] spacing = B;  // clocks since the last update
  wire [V+I+1:0] outputs = {velocity, interval, forced, beyond};
  always @(posedge clk)
    if (rst) begin
      {due, held, past} <= 0;
      spacing <= B;
    end else begin
      spacing <= velocity_valid ? 1 : spacing < B ? spacing + 1 : B;
      due <= since == B;
      {due_measuring, due_silent, due_many} <= {measuring, silent, many_now};
      due_distance <= distance;
      due_times <= times;
      held <= outputs;
      past <= velocity;
    end

  // What is shown: the one that was due at the last update; where there is one due that makes none, that.
  reg was_silent = 0, was_many = 0;
  reg signed [I+Q:0] was_distance = 0;
  reg [I-1:0] was_times = 0;  // 0: none
  wire shown_silent = due ? due_silent : was_silent;
  wire shown_many = due ? due_many : was_many, kept = due && !velocity_valid;
  wire signed [I+Q:0] shown_distance = due ? due_distance : was_distance;
  wire [I-1:0] shown_times = due ? due_times : was_times;
  always @(posedge clk)
    if (rst) {was_silent, was_many, was_distance, was_times} <= 0;
    else if (!kept) begin
      {was_silent, was_many} <= {shown_silent, shown_many};
      {was_distance, was_times} <= {shown_distance, shown_times};
    end

  // Which of them began, after an upset, when what is given held; after a reset those too that there are not. A decay is
  // of use only if what it is compared with is.
  reg [7:0] fresh_clocks = 0;
  reg fresh_division = SETTLED < 0, fresh_due = SETTLED < 0, fresh_before = SETTLED < 0, fresh_past = SETTLED < 0;
  wire fresh_now = fresh_clocks == SETTLED, fresh = due ? fresh_due : fresh_before;
  always @(posedge clk) begin
    if (!fresh_now) fresh_clocks <= fresh_clocks + 1;
    if (fresh_now && (rst || overdue || measured || (decays && fresh))) fresh_division <= 1;
    fresh_due <= fresh_division;
    if (fresh_now && rst) {fresh_before, fresh_past} <= 2'b11;
    else begin
      if (!kept) fresh_before <= fresh;
      fresh_past <= fresh;
    end
  end

  // 2^f x + 1/2 = (2^f distance + times) / (2 times), rounded down, and the largest that can be shown.
  wire signed [N+I+2:0] wanted = (shown_distance <<< FRAC_BITS) + $signed({1'b0, shown_times});
  wire signed [N+I+2:0] divisor = $signed({1'b0, shown_times, 1'b0}), have = divisor * velocity;
  localparam signed [V-1:0] LIMIT = MAX_VELOCITY << FRAC_BITS;
  wire fits = !SATURATES || (wanted < divisor * (LIMIT + 1) && wanted >= -divisor * LIMIT);

  // Lemmas: what the induction needs to know of the state. Of a division: what is divided, shifted, is the remainder and
  // the divisor times the digits so far, 1 or -1 each; what is left of it is in a register, as far as it is no divisor.
  wire [4:0] j = since - 1;
  localparam A = Q + FRAC_BITS - 1;  // bits of any quotient
  wire signed [A+I+1:0] all = (distance <<< FRAC_BITS - 1) + $signed({1'b0, times[I-1:1]});
  wire signed [A+I+1:0] taken = all >>> (N - j);
  // The divider has fewer digits than the quotient, which the second one tells, or cannot take the distance.
  localparam signed [A+I+1:0] FARTHEST = 1 << (I + N - FRAC_BITS);
  wire signed [A+I+1:0] end_of_digits = $signed({1'b0, times}) <<< N;
  wire far = N < A && measuring && (distance >= FARTHEST || distance < -FARTHEST);
  wire over = far || (N < A && (all >= end_of_digits || all < -end_of_digits));
  reg [N:0] all_digits = 0;
  always @(posedge clk) if (core_running) all_digits <= {all_digits, core_remainder >= 0};
  wire [N:0] found_digits = all_digits & ((1 << j) - 1);
  wire signed [N+1:0] digits = $signed({1'b0, found_digits, 1'b0}) - (1 <<< j) + 1;
  wire signed [N+I+1:0] passed = $signed({1'b0, times}) * digits;
  wire signed [N+I+2:0] asked = (distance <<< FRAC_BITS) + $signed({1'b0, times}), twice = $signed({1'b0, times, 1'b0});
  wire signed [N:0] quotient = $signed({!all_digits[N], all_digits[N-1:0]});
  wire signed [N+I+2:0] found = twice * quotient;
  // The bound, its first digits, and the velocity, signs inverted.
  wire minus = distance < 0;
  wire signed [N:0] bound = !measuring ? velocity : minus ? -LIMIT : LIMIT;
  wire [N:0] bound_digits = {!bound[N], bound[N-1:0]} >> (N + 1 - j);
  // The digits that are left, the first of which are held.
  localparam D = DIVIDEND_DIGITS;
  wire [N-1:0] left_digits = all & ((1 << (N - j)) - 1);
  wire [D-1:0] next_digits = N - j >= D ? left_digits >> (N - j - D) : left_digits << (D - (N - j));
  wire signed [N:0] long_velocity = velocity;
  wire [N:0] velocity_digits = {!long_velocity[N], long_velocity[N-1:0]};
  wire core_passes;
  wire [N:0] taken_digits = core_copy & ((1 << j) - 1);
  wire signed [W+3:0] most = measuring ? 2 * MAX_QUOTIENT * times : (times << Q) - 1, farthest = (LATTICE ? MAX_COUNT : 1) * (length - 1);
  reg [$clog2(T):0] phase = PHASES;  // of the timer period, 1 to PHASES; waits for the first tick
  always @(posedge clk) phase <= rst ? PHASES : period ? 1 : phase < PHASES ? phase + 1 : PHASES;
  always @* begin
    lemma_idle: assert (idle <= LONG + B && age >= 1 && age <= MAX_PERIODS);
    lemma_age: assert (!opened || (LATTICE ? idle + 1 == (age - 1) * T + phase : age == idle + 1));
    lemma_timer: assert (core_age == age && core_opened == opened
        && core_negative == (!LATTICE && count ? negative : was_negative));
    lemma_starts: assert (core_ticked == tick && core_count == count && core_overdue == overdue && core_ends == measured
        && core_decays == decays && core_start == (overdue || measured || decays));
    lemma_since: assert (since <= B && since <= spacing + !velocity_valid && spacing <= B);
    lemma_free: assert (since == 0 || !measuring || since >= (age - 1) * PHASES + phase);
    lemma_running: assert (core_running == (since >= 1 && since <= N + 1) && core_done == (since == B));
    lemma_kept: assert (!fresh_division || since == 0 || (core_measuring == measuring && core_forced == silent
        && core_by == times));
    lemma_asked: assert (!fresh_division || since == 0 || (times >= 1 && distance <= most && -distance <= most));
    lemma_times: assert (!fresh_division || since == 0 || times <= MAX_PERIODS + (MT ? PATIENCE : 0));
    lemma_silent: assert (since == 0 || !silent || !measuring || distance == 0);
    lemma_many: assert (since == 0 || !many_now || (measuring && !silent && times == 1));
    lemma_left: assert (!fresh_division || !core_running || far || N == j || (core_digits ^ next_digits) >> (N - j >= D ? 0 : D - (N - j)) == 0);
    lemma_steps: assert (!core_running || core_steps == N - 1 - $signed({1'b0, j}));
    lemma_remainder: assert (!fresh_division || !core_running || over || (core_remainder < $signed({1'b0, times})
        && core_remainder >= -$signed({1'b0, times})));
    lemma_over: assert (!fresh_division || !core_running || !over || far || j != 1 || (core_remainder < 0) == minus);
    lemma_quotient: assert (!fresh_division || !core_running || far || (over && j != 0) || taken == core_remainder + passed);
    lemma_found: assert (!fresh_division || since < B || over || (found <= asked && asked < found + twice));
    lemma_compared: assert (!fresh_division || since == 0 || !(measuring ? SATURATES : fresh)
        || (over ? (far || !core_nearer) && core_passes == (since > 2 || (far && since > 1))
            : core_nearer == (minus ? found_digits > bound_digits : found_digits < bound_digits)
            && core_passes == (minus ? found_digits < bound_digits : found_digits > bound_digits)));
    lemma_taken: assert (!fresh_division || since == 0 || taken_digits == (core_passes ? bound_digits : found_digits) || (!fresh && !measuring && core_passes));
    lemma_copy: assert (!fresh || (since != 0 && measuring)
        || core_copy >> (since == 0 ? 0 : j) == (velocity_digits & ((1 << (since == 0 ? N + 1 : N + 1 - j)) - 1)));
    lemma_decays: assert (!fresh_division || since == 0 || measuring
        || (distance == (velocity < 0 ? -3 * P : 3 * P) && silent));
    lemma_decayed: assert (!fresh_due || !due || due_measuring
        || (due_distance == (past < 0 ? -3 * P : 3 * P) && due_silent));
    lemma_rest: assert (opened || idle == LONG + B || (measuring && since == idle - LONG + 1 && distance == 0));
    lemma_rested: assert (opened || since == 0 || !measuring || (distance == 0 && silent));
    lemma_rests: assert (quiet <= MAX_TICKS + 1 && rested == (quiet > MAX_TICKS) && core_rests == rested
        && core_silent == (quiet != 0)
        && (quiet == 0 || rested || core_empty == MAX_TICKS - 1 - $signed({1'b0, quiet})));
    lemma_size: assert (pulse_count <= MAX_COUNT && -pulse_count <= MAX_COUNT);
    lemma_fresh: assert (fresh && fresh_past);
    lemma_began: assert (!fresh_division || fresh || (since != 0 && measuring));
    lemma_settled: assert (SETTLED < 0 || ((!fresh_division || fresh_now)
        && (fresh_division || !(fresh_due || fresh_before || fresh_past))));
    lemma_limit: assert (!fresh || velocity <= LIMIT && velocity >= -LIMIT && past == $signed(held[V+I+1-:V]));
  end
  generate
    if (SATURATES) begin : holds
      wire core_back, core_most;
      always @* begin
        lemma_back: assert (!fresh_division || since == 0 || core_back == minus);
        lemma_most: assert (!fresh_division || !core_running || !measuring || core_most == (j == 0 ? !minus : bound[N - j]));
      end
    end
    if (FLAGS) begin : flag
      wire core_beyond;
      always @* lemma_beyond: assert (since == 0 || core_beyond == many_now);
    end
    if (!LATTICE) begin : clocked
      wire core_came, core_nearly;
      wire signed [$clog2(3 * T + 1):0] core_way;
      wire leads = moved && back == last_negative;
      assign shown_came = core_came;
      always @* begin
        lemma_came: assert (came == core_came);
        lemma_nearly: assert (core_nearly == (age == MAX_PERIODS - 1));
        lemma_way: assert (core_way == (decays ? (velocity < 0 ? -3 * T : 3 * T) : !leads ? 0 : back ? -2 * T : 2 * T));
      end
    end else assign shown_came = 0;
    if (LATTICE) begin : lattice
      wire signed [$clog2(T-1):0] core_window;
      wire core_last;
      reg [$clog2(T):0] clock = 0;
      reg ticked = 0;
      wire signed [$clog2(T)+1:0] shown_clock = T - 2 - core_window;
      wire [$clog2(T):0] elapsing = UPSET ? $unsigned(shown_clock) : clock;
      always @(posedge clk) begin
        clock <= rst || elapsing == T - 1 ? 0 : elapsing + 1;
        ticked <= !rst && (ticked || tick);
      end
      always @* begin
        lemma_last: assert (core_last == (age == MAX_PERIODS));
        lemma_window: assert (clock < T && core_window == T - 2 - $signed({1'b0, clock}));
        lemma_phase: assert (phase >= 1 && phase <= T && (!tick || phase == T) && (ticked || !opened)
            && (!ticked || (phase == (clock + T - 2) % T + 1 && tick == (phase == T))));
      end
    end
    if (MT) begin : mt
      wire [I-1:0] core_length;
      wire [$clog2(PATIENCE+1)-1:0] core_still;
      wire core_late;
      wire signed [TRAVELLED_WIDTH-1:0] core_travelled;
      assign late = UPSET && CYCLE > 1 ? core_late : (UPSET ? core_length : length) > MIN_PERIODS;
      always @* begin
        lemma_length: assert (length >= 1 && (!opened || (length <= PATIENCE + age && core_length == length
            && core_late == (length > MIN_PERIODS))));
        lemma_unopened: assert (opened || length == 1);
        lemma_core_length: assert (opened || age == 1 || (core_still == {{$clog2(PATIENCE + 1) - 1{1'b1}}, 1'b0} && !core_late));
        lemma_travelled: assert (!opened || (core_travelled == P * travelled && travelled <= farthest && -travelled <= farthest));
        lemma_window_free: assert (since == 0 || !measuring || since >= (length - 1) * PHASES + phase);
      end
    end else assign late = 0;
    if (CYCLE > 1) begin : cycles
      wire [$clog2(CYCLE)-1:0] core_counted;
      wire core_cycled, core_waived;
      wire signed [W-1:0] distance = travelled < 0 ? -travelled : travelled;
      assign shown_within = core_cycled && core_counted != CYCLE - 1, shown_waived = core_waived;
      always @* begin
        lemma_waived: assert (!opened || core_waived == (turned_back || length > PATIENCE));
        lemma_counted: assert (!opened || turned_back || (core_counted == (distance & (CYCLE - 1))
            && core_cycled == (distance >= CYCLE)));
        lemma_one_way: assert (!opened || turned_back || travelled == 0 || (travelled < 0) == was_negative);
      end
    end else assign shown_within = 0, shown_waived = 0;
  endgenerate
  always @* begin
    pt_update: assert (due && due_measuring ? velocity_valid : !velocity_valid || due);
    pt_spacing: assert (!velocity_valid || spacing >= B);
    pt_interval: assert (!fresh || kept || (interval == shown_times && forced == shown_silent));
    pt_range: assert (!fresh || !velocity_valid || (interval >= 1 && interval <= MAX_PERIODS + (MT ? PATIENCE : 0)));
    pt_velocity: assert (!fresh || kept || (SATURATES && beyond) || (have <= wanted && wanted < have + divisor)
        || (shown_times == 0 && velocity == 0));
    pt_flag: assert (!fresh || kept || shown_times == 0 || beyond == (FLAGS && (!fits || shown_many)));
    pt_saturated: assert (!fresh || fits || kept || shown_times == 0 || velocity == (shown_distance < 0 ? -LIMIT : LIMIT));
    pt_decays: assert (!fresh_past || !fresh_due || !velocity_valid || due_measuring || (forced
        && (past < 0 ? velocity <= 0 && velocity > past : velocity >= 0 && velocity < past)));
    pt_bound: assert (!fresh_past || !fresh_due || !due || due_measuring || (velocity >= 0 ? have <= wanted : have + divisor > wanted));
    pt_rest: assert (idle < LONG + B || velocity == 0);
    pt_standstill: assert (standstill == rests);
    pt_held: assert (velocity_valid || outputs == held);
  end
endmodule
