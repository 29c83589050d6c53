// A motor with an encoder and a core on its lines, under a controller: the plant of docs/control.md in double precision,
// the controller of sim/control/controller.py in the same, and the core clock by clock. It is compiled behind a
// `struct Model`, which the engine writes. Angles are in rad, currents in A, times in s, but for those in clocks.

#include <algorithm>
#include <cmath>

template <class Integer>
static inline int64_t extended(Integer raw, int width, bool is_signed) {
  return is_signed ? int64_t(uint64_t(raw) << (64 - width)) >> (64 - width) : int64_t(raw);
}

struct Motor {
  double inertia, torque_constant, driver_seconds, current_limit;
  double viscous, coulomb;  // Nm/(rad/s), Nm
};

struct Encoder {
  double pitch;  // of edges
  const double *offset;  // of each edge of the disc, in pitches
  int64_t n_edges;
  const double *jitter;  // of each passage, in pitches; used again when all have been
  int64_t n_jitter;
};

struct Controller {
  double position_gain, velocity_gain, observer_rate, filter_rate;  // k_p, k_v, G_dis, G_v
  double inertia, torque_constant, current_limit;  // as the controller knows them
  int64_t clocks;  // between two control ticks
  int64_t synchronised;  // filter and observer with the updates of the velocity, as in Fig. 11
  int64_t feed_forward;  // of the command's acceleration
};

struct Core {
  double rad_per_s, rad_per_count;  // of an LSB of the velocity
  double interval_seconds;  // unit of `interval`; 0: the time since the update before
  int64_t velocity, valid, interval, position;  // columns
  double clock_seconds;
};

struct Tables {  // values at equal distances: the command and the load
  const double *speed, *angle, *load;
  int64_t n;
  int64_t clocks;  // between two
};

struct Loop {
  Motor motor;
  Encoder encoder;
  Controller controller;
  Core core;
  Tables tables;
  int64_t step, end, log;  // clocks: of the plant, of the run, between two rows of the log
  double *rows;
  int64_t n_rows;
};

#if defined(_WIN32)
#define ENTRY extern "C" __declspec(dllexport)
#else
#define ENTRY extern "C" __attribute__((visibility("default")))
#endif

struct Shaft {
  const Motor &motor;
  const Encoder &encoder;
  const double seconds;  // of a step
  const double kept;  // of the difference between current and command
  double angle = 0, speed = 0, current = 0;
  int64_t edge = 0;  // edges passed, so the quarter
  int64_t passages = 0;
  double shift = 0, shift_above = 0;  // of the edges below and above it, by jitter

  Shaft(const Loop &loop)
      : motor(loop.motor), encoder(loop.encoder), seconds(double(loop.step) * loop.core.clock_seconds),
        kept(motor.driver_seconds > 0 ? std::exp(-seconds / motor.driver_seconds) : 0), angle(encoder.pitch / 2) {
    shift_above = jitter();
  }
  double jitter() { return encoder.jitter[passages++ % encoder.n_jitter]; }
  double place(int64_t number) const {
    int64_t within = number % encoder.n_edges;
    return (double(number) + encoder.offset[within < 0 ? within + encoder.n_edges : within]) * encoder.pitch;
  }
  // Goes on by a step under a commanded current and a load.
  void move(double command, double load) {
    double mean = command + (current - command) * (1 - kept) * motor.driver_seconds / seconds;
    current = command + (current - command) * kept;
    double torque = motor.torque_constant * mean - load - motor.viscous * speed;
    double before = speed;
    // Coulomb friction brakes, and holds a shaft that rests.
    double friction = motor.coulomb;
    if (speed > 0 || (speed == 0 && torque > friction)) torque -= friction;
    else if (speed < 0 || (speed == 0 && torque < -friction)) torque += friction;
    else torque = 0;
    speed += torque / motor.inertia * seconds;
    if (friction > 0 && before * speed < 0) speed = 0;
    angle += (before + speed) / 2 * seconds;
  }
};

// The lines in the quarters: A leads B forwards.
static inline uint8_t lines(int64_t quarter) {
  static const uint8_t level[4] = {0, 1, 3, 2};
  return level[quarter & 3];
}

struct Control {
  const Controller &gains;
  const Core &core;
  double held = 0, y = 0, z = 0, disturbance = 0, command = 0;
  double sum = 0;  // of the current since the update before
  int64_t n = 0, position = 0;

  // Eq. (22): the weight of what is new after so many seconds.
  static double weight(double rate, double seconds) { return -std::expm1(-rate * seconds); }
  void filter(double seconds, double current) {
    double to_speed = gains.torque_constant / (gains.inertia * gains.observer_rate);
    y += weight(gains.filter_rate, seconds) * (held - y);
    z += weight(gains.observer_rate, seconds) * (to_speed * current + y - z);
    disturbance = gains.inertia * gains.observer_rate * (z - y);
  }
  void update(double velocity, double seconds) {
    held = velocity;
    if (!gains.synchronised || n == 0) return;
    filter(seconds, sum / double(n));
    sum = 0;
    n = 0;
  }
  void tick(double seconds, double speed, double angle, double acceleration) {
    if (!gains.synchronised) filter(seconds, command);
    double error = angle - double(position) * core.rad_per_count;
    double wanted = gains.position_gain * error + gains.velocity_gain * (speed - y);
    if (gains.feed_forward) wanted += acceleration;
    double current = (gains.inertia * wanted + disturbance) / gains.torque_constant;
    command = std::clamp(current, -gains.current_limit, gains.current_limit);
    sum += command;
    n++;
  }
};

ENTRY __attribute__((flatten)) void loop_run(Loop *loop) {
  Model home;
  Working working(home);
  Model &model = working.model;
  Shaft shaft(*loop);
  Control control{loop->controller, loop->core};
  const Tables &tables = loop->tables;
  const Core &core = loop->core;
  double *row = loop->rows;
  int64_t outputs[N_COLUMNS];
  int64_t begun = 0;  // clock of the update before
  model.pins(lines(shaft.edge));
  for (int64_t clock = 0; clock < loop->end; clock += loop->step) {
    int64_t at = std::min(clock / tables.clocks, tables.n - 2);
    double within = double(clock - at * tables.clocks) * core.clock_seconds;
    double slope = (tables.speed[at + 1] - tables.speed[at]) / (double(tables.clocks) * core.clock_seconds);
    double speed = tables.speed[at] + slope * within;
    if (clock % loop->controller.clocks == 0) {
      model.settle();
      model.outputs(outputs);
      control.position = outputs[core.position];
      double angle = tables.angle[at] + (tables.speed[at] + slope * within / 2) * within;
      control.tick(double(loop->controller.clocks) * core.clock_seconds, speed, angle, slope);
    }
    if (clock % loop->log == 0) {
      const double values[] = {double(clock) * core.clock_seconds, speed, shaft.speed, shaft.angle, control.held,
          control.y, control.z, control.disturbance, control.command, shaft.current, double(control.position)};
      row = std::copy(std::begin(values), std::end(values), row);
      loop->n_rows++;
    }
    double before = shaft.angle;
    shaft.move(control.command, tables.load[at]);
    // Edges on the way, in order; each changes a line in the clock in which it is passed.
    int64_t now = clock, until = clock + loop->step;
    bool more = true;
    while (more) {
      double above = shaft.place(shaft.edge + 1) + shaft.shift_above * shaft.encoder.pitch;
      double below = shaft.place(shaft.edge) + shaft.shift * shaft.encoder.pitch;
      int64_t change = until;
      int turn = shaft.angle >= above ? 1 : shaft.angle < below ? -1 : 0;
      if (turn) {
        double part = ((turn > 0 ? above : below) - before) / (shaft.angle - before);
        change = std::max(now, clock + int64_t(std::clamp(part, 0.0, 1.0) * double(loop->step)));
        if (change >= until) change = until - 1;
      } else {
        more = false;
      }
      for (; now < change; now++) {
        model.settle();
        if (model.strobe()) {
          model.outputs(outputs);
          if (outputs[core.valid]) {
            double seconds = double(outputs[core.interval]) * core.interval_seconds;
            if (core.interval_seconds == 0) seconds = double(now - begun) * core.clock_seconds;
            begun = now;
            control.update(double(outputs[core.velocity]) * core.rad_per_s, seconds);
          }
        }
        int64_t idle = model.idle();
        if (idle > 1) {
          idle = std::min(idle, change - now);
          model.move_on(idle);
          now += idle - 1;
        } else {
          model.edge();
        }
      }
      if (turn) {
        shaft.edge += turn;
        (turn > 0 ? shaft.shift : shaft.shift_above) = turn > 0 ? shaft.shift_above : shaft.shift;
        (turn > 0 ? shaft.shift_above : shaft.shift) = shaft.jitter();
        model.pins(lines(shaft.edge));
        if (now == until - 1 && change == until - 1) more = true;
      }
    }
  }
}
