// A core on the lines of a motor's encoder, under a controller: clock by clock. It stands behind plant.h, control.h and
// a `struct Model`, which the engine writes.

template <class Integer>
static inline int64_t extended(Integer raw, int width, bool is_signed) {
  return is_signed ? int64_t(uint64_t(raw) << (64 - width)) >> (64 - width) : int64_t(raw);
}

struct Core {
  double rad_per_s, rad_per_s2, rad_per_count;  // of an LSB of the velocity, the acceleration and the position
  int64_t velocity, valid, position, acceleration;  // columns; -1: there is none
  double clock_seconds;
};

struct Course {  // values at equal distances: what is commanded, and what comes in between
  const double *speed, *angle, *load, *current;
  int64_t n;
  int64_t clocks;  // between two
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
  const volatile int64_t *stop;  // whether to end at once
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
  int64_t now = 0, begun = 0;  // clock of the update before
  int64_t outputs[N_COLUMNS];

  void to(int64_t clock) {
    for (; now < clock; now++) {
      model.settle();
      if (model.strobe()) {
        model.outputs(outputs);
        if (outputs[core.valid]) {
          double acceleration = core.acceleration < 0 ? 0 : double(outputs[core.acceleration]) * core.rad_per_s2;
          double seconds = double(now - begun) * core.clock_seconds;
          control.update(double(outputs[core.velocity]) * core.rad_per_s, acceleration, seconds);
          begun = now;
        }
      }
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
  int64_t position() {
    model.settle();
    model.outputs(outputs);
    return outputs[core.position];
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
  Watch watch{working.model, control, core};
  Due tick{loop->controller.clocks, loop->controller.first}, act{tick.every, tick.next + loop->controller.delay};
  Due log{loop->log, 0};
  double *row = loop->rows, driven = 0;
  working.model.pins(shaft.lines());
  for (int64_t clock = 0; clock < loop->end && !*loop->stop;) {
    int64_t at = std::min(clock / course.clocks, course.n - 2);
    double within = double(clock - at * course.clocks) * core.clock_seconds;
    double slope = (course.speed[at + 1] - course.speed[at]) / (double(course.clocks) * core.clock_seconds);
    double speed = course.speed[at] + slope * within;
    if (act.at(clock)) driven = control.command;
    if (tick.at(clock)) {
      double angle = course.angle[at] + (course.speed[at] + slope * within / 2) * within;
      double error = angle - double(watch.position()) * core.rad_per_count;
      control.tick(double(tick.every) * core.clock_seconds, speed, slope, error);
      if (loop->controller.delay == 0) driven = control.command;
    }
    if (log.at(clock)) {
      const double values[] = {double(clock) * core.clock_seconds, speed, shaft.speed, shaft.angle, control.held,
          control.y, control.z, control.disturbance, control.command, shaft.current, double(watch.position())};
      row = std::copy(std::begin(values), std::end(values), row);
      loop->n_rows++;
    }
    int64_t until = std::min({clock + loop->step, (at + 1) * course.clocks, tick.next, act.next, log.next, loop->end});
    double before = shaft.angle;
    shaft.move(double(until - clock) * core.clock_seconds, driven + course.current[at], course.load[at]);
    // Edges on the way, in order; each changes a line in the clock in which it is passed.
    while (int turn = shaft.passing()) {
      double way = shaft.angle - before, part = way == 0 ? 0 : ((turn > 0 ? shaft.above : shaft.below) - before) / way;
      int64_t change = clock + int64_t(std::clamp(part, 0.0, 1.0) * double(until - clock));
      watch.to(std::min(change, until - 1));
      shaft.pass(turn);
      working.model.pins(shaft.lines());
    }
    watch.to(until);
    clock = until;
  }
}
