// A core on the lines of a motor's encoder, clock by clock, under a controller: that of control.h, or with GATES one in
// the core itself. It stands behind plant.h, control.h and a `struct Model`, which the engine writes.

template <class Integer>
static inline int64_t extended(Integer raw, int width, bool is_signed) {
  return is_signed ? int64_t(uint64_t(raw) << (64 - width)) >> (64 - width) : int64_t(raw);
}

struct Core {
  double rad_per_s, rad_per_s2, rad_per_count;  // of an LSB of the velocity, the acceleration and the position
  int64_t velocity, valid, position, acceleration, forced;  // columns; -1: there is none
  int64_t longest;  // clocks after which an update without a count is taken as a measurement
  double clock_seconds;
};

struct Course {  // values at equal distances: what is commanded, and what comes in between
  const double *speed, *angle, *load, *current;
  int64_t n;
  int64_t clocks;  // between two
};

// A controller in gates: its inputs and outputs, and what came in and out, to be computed again by its golden model.
struct Gates {
  double amperes, y, torque;  // of an LSB of the current, the filtered velocity and the disturbance
  double position, velocity, acceleration;  // rad, rad/s, rad/s² of an LSB of a command
  int64_t feed_forward, most_velocity, most_acceleration;
  uint64_t position_mask;
  int64_t valid, current, filtered, lead;  // columns
  int64_t *commands, *currents, *edges;  // rows of three numbers, of four and of two
  int64_t n_commands, n_currents, n_edges, most_edges;
};

struct Loop {
  Motor motor;
  Encoder encoder;
  Controller controller;
  Core core;
  Course course;
  int64_t step, end, log;  // clocks: of the plant at most, of the run, between two rows of the log
  double *rows;
  int64_t n_rows;
  int64_t away;  // clock in which the shaft ran away; -1: it did not
  const volatile int64_t *stop;  // whether to end at once
  Gates *gates;
};

#if defined(_WIN32)
#define ENTRY extern "C" __declspec(dllexport)
#else
#define ENTRY extern "C" __attribute__((visibility("default")))
#endif

// The core in a loop: it runs on to a clock, and tells the controller its updates.
struct Watch {
  Model &model;
  Control &control;
  const Core &core;
  Gates *gates;
  int64_t now = 0, begun = 0;  // clock of the update before
  int64_t outputs[N_COLUMNS] = {};
#if GATES
  uint64_t levels[N_PINS] = {};

  void lines(uint8_t level) {
    levels[PIN_A] = level & 1;
    levels[PIN_B] = level >> 1;
    model.pins(levels);
    if (gates->n_edges < gates->most_edges) {
      int64_t *row = gates->edges + 2 * gates->n_edges++;
      row[0] = now;
      row[1] = level;
    }
  }
  static int64_t rounded(double value, int64_t most) {
    return std::clamp(int64_t(std::llround(value)), -most - 1, most);
  }
  // The commands that the control tick in this clock takes.
  void command(double speed, double slope, double angle) {
    int64_t *row = gates->commands + 3 * gates->n_commands++;
    row[0] = std::llround(angle / gates->position);  // its upper bits are not there: it wraps
    row[1] = rounded(speed / gates->velocity, gates->most_velocity);
    row[2] = gates->feed_forward ? rounded(slope / gates->acceleration, gates->most_acceleration) : 0;
    levels[PIN_ENABLE] = 1;
    levels[PIN_POSITION] = uint64_t(row[0]) & gates->position_mask;
    levels[PIN_VELOCITY] = uint64_t(row[1]) & uint64_t(2 * gates->most_velocity + 1);
    levels[PIN_ACCELERATION] = uint64_t(row[2]) & uint64_t(2 * gates->most_acceleration + 1);
    model.pins(levels);
  }
  void shown() {
    if (outputs[core.valid]) control.held = double(outputs[core.velocity]) * core.rad_per_s;
    if (!outputs[gates->valid]) return;
    int64_t *row = gates->currents + 4 * gates->n_currents++;
    row[0] = now;
    row[1] = outputs[gates->current];
    row[2] = outputs[gates->filtered];
    row[3] = outputs[gates->lead];
    control.command = double(row[1]) * gates->amperes;
    control.y = double(row[2]) * gates->y;
    control.z = control.y + double(row[3]) * gates->y;
    control.disturbance = double(row[3]) * gates->torque;
  }
#else
  void lines(uint8_t level) { model.pins(level); }
  void shown() {
    if (!outputs[core.valid]) return;
    double acceleration = core.acceleration < 0 ? 0 : double(outputs[core.acceleration]) * core.rad_per_s2;
    double seconds = double(now - begun) * core.clock_seconds;
    bool measured = core.forced < 0 || !outputs[core.forced] || now - begun >= core.longest;
    control.update(double(outputs[core.velocity]) * core.rad_per_s, acceleration, seconds, measured);
    if (measured) begun = now;
  }
#endif

  // Goes on to a clock, and looks at the outputs in it if it is asked to.
  void to(int64_t clock, bool looks) {
    for (; now < clock || looks; now++) {
      model.settle();
      bool there = now >= clock;
      if (there || model.strobe()) model.outputs(outputs);
      if (there) break;
      if (model.strobe()) shown();
      int64_t idle = model.idle();
      if (idle > 1) {
        idle = std::min(idle, clock - now);
        model.move_on(idle);
        now += idle - 1;
      } else {
        model.edge();
      }
    }
  }
};

// A clock in which the plant stops: the next one, or none before the end.
struct Due {
  int64_t every, next;
  bool at(int64_t clock) {
    if (clock != next) return false;
    next += every;
    return true;
  }
};

ENTRY __attribute__((flatten)) void loop_run(Loop *loop) {
  Model home;
  Working working(home);
  Shaft shaft(loop->motor, loop->encoder);
  Control control(loop->controller);
  const Core &core = loop->core;
  const Course &course = loop->course;
  Watch watch{working.model, control, core, loop->gates};
  Due tick{loop->controller.clocks, loop->controller.first}, act{tick.every, tick.next + loop->controller.delay};
  Due log{loop->log, 0};
  double *row = loop->rows, driven = 0;
  watch.lines(shaft.lines());
  for (int64_t clock = 0; clock < loop->end && !*loop->stop;) {
    int64_t at = std::min(clock / course.clocks, course.n - 2);
    double within = double(clock - at * course.clocks) * core.clock_seconds;
    double slope = (course.speed[at + 1] - course.speed[at]) / (double(course.clocks) * core.clock_seconds);
    double speed = course.speed[at] + slope * within;
    if (act.at(clock)) driven = control.command;
    bool ticks = tick.at(clock), logs = log.at(clock);
    int64_t position = watch.outputs[core.position];
    if (ticks) {
      double angle = course.angle[at] + (course.speed[at] + slope * within / 2) * within;
#if GATES
      watch.command(speed, slope, angle);
#else
      double error = angle - double(position) * core.rad_per_count;
      control.tick(double(tick.every) * core.clock_seconds, speed, slope, error);
      if (loop->controller.delay == 0) driven = control.command;
#endif
    }
    if (logs) {
      const double values[] = {double(clock) * core.clock_seconds, speed, shaft.speed, shaft.angle, control.held,
          control.y, control.z, control.disturbance, control.command, shaft.current, double(position)};
      row = std::copy(std::begin(values), std::end(values), row);
      loop->n_rows++;
    }
    int64_t until = std::min({clock + loop->step, (at + 1) * course.clocks, tick.next, act.next, log.next, loop->end});
    double before = shaft.angle;
    shaft.move(double(until - clock) * core.clock_seconds, driven + course.current[at], course.load[at]);
    // Edges on the way, in order; each changes a line in the clock in which it is passed. The core stands in one place
    // of this loop, as its text is long.
    int64_t most = 2 * (until - clock) + 2;  // no core counts as many, and far away none may be the last
    while (true) {
      int turn = shaft.passing();
      if (turn ? most-- == 0 : !std::isfinite(shaft.angle)) {
        loop->away = clock;
        return;
      }
      int64_t stop = until;
      if (turn) {
        double way = shaft.angle - before, part = way == 0 ? 0 : ((turn > 0 ? shaft.above : shaft.below) - before) / way;
        stop = std::min(clock + int64_t(std::clamp(part, 0.0, 1.0) * double(until - clock)), until - 1);
      }
      watch.to(stop, !turn && (until == tick.next || until == log.next));
      if (!turn) break;
      shaft.pass(turn);
      watch.lines(shaft.lines());
    }
    clock = until;
  }
}
