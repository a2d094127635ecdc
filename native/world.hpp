// Analogue part of the virtual rig: sensor outputs of a motion, and the connections of a fast control loop.
#pragma once
#include "shaker.hpp"
#include "signal.hpp"

namespace vibench {

// One sample of a real-time controller: phase, Fourier series, control law, and measured coefficients.

constexpr int MOST_HARMONICS = 20;
constexpr int MOST_MEMORY = 64;

// Returns a smooth function of `share` that rises from 0 to 1 along half a cosine.
INLINE double eased(double share) { return 0.5 - 0.5 * cosine_sine(PI * share).cosine; }

// Returns the output of the control law [V], and updates its states for the next sample.
inline double answer_of_law(Controller &c, double base_volts, double m0_volts) {
  double next[MOST_MEMORY], volts = c.direct[0] * base_volts + c.direct[1] * m0_volts;
  for (int k = 0; k < c.remembered; k++) volts += c.output[k] * c.memory[k];
  for (int row = 0; row < c.remembered; row++) {
    next[row] = c.inlet[row][0] * base_volts + c.inlet[row][1] * m0_volts;
    for (int k = 0; k < c.remembered; k++) next[row] += c.step[row][k] * c.memory[k];
  }
  for (int row = 0; row < c.remembered; row++) c.memory[row] = next[row];
  return volts;
}

// Adds a sample to the Fourier coefficients of a block. With Hann weights a block may end between samples.
inline void add_to_block(Controller &c, const double (&sampled)[3], const Phasor &turn) {
  double weight = 1.0 - cosine_sine(2.0 * PI * c.turns / c.block).cosine;
  Phasor back{weight, 0.0};
  for (int k = 0; k <= c.harmonics; k++) {
    for (int row = 0; row < 3; row++) c.sums[row][k] = c.sums[row][k] + sampled[row] * back;
    back = back * conjugate(turn);
  }
  c.weight += weight;
  c.turns += c.omega / (2.0 * PI);
  if (!(c.turns >= c.block)) return;
  for (int row = 0; row < 3; row++)
    for (int k = 0; k <= c.harmonics; k++) {
      c.coefficients[row][k] = ((k == 0 ? 1.0 : 2.0) / c.weight) * c.sums[row][k];
      c.sums[row][k] = {0.0, 0.0};
    }
  c.done = 1 + c.is_steady;
  c.turns = c.weight = 0.0;
  c.is_steady = 1;
}

// Returns the output for the mean sensor voltages over the last sample [V]; zero while the controller is off.
inline double answer(Controller &c, double base_volts, double m0_volts) {
  if (!c.is_on) return 0.0;
  c.unheard += 1.0;
  if (c.glide < 1.0) {
    c.glide = smaller(c.glide + c.glide_step, 1.0);
    c.is_steady = 0;
  }
  double share = eased(c.glide), volts = 0.0;
  c.omega = c.omega_from + share * (c.omega_to - c.omega_from);
  Phasor turn = turned_by(c.theta), turned = turn;
  for (int k = 0; k < c.harmonics; k++) {
    volts += real_of_product(c.reference[0][k] + share * (c.reference[1][k] - c.reference[0][k]), turned);
    turned = turned * turn;
  }
  volts += answer_of_law(c, base_volts, m0_volts);
  if (c.fade_step > 0.0) {
    c.fade = larger(c.fade - c.fade_step, 0.0);
    c.is_steady = 0;
  }
  volts *= eased(c.fade);
  c.at_limit = magnitude(volts) > c.limit ? c.at_limit + 1.0 : 0.0;
  volts = smaller(larger(volts, -c.limit), c.limit);
  add_to_block(c, {volts, base_volts, m0_volts}, turn);
  double theta = c.theta + c.omega;
  c.theta = theta - 2.0 * PI * whole_part(theta / (2.0 * PI));
  return volts;
}

// Returns whether the host must act before the next sample: to store a block, or because the controller ends.
inline bool wants_attention(const Controller &c) {
  bool has_ended = c.is_on && c.fade <= 0.0;
  return c.done > 0 || c.unheard > c.most_unheard || c.at_limit > c.most_at_limit || has_ended;
}

// Computes the output voltage of a sensor for the steps `begin` to `stop` - 1.
inline void show(const Sensor &sensor, int64_t begin, int64_t stop) {
  double *volts = sensor.volts.at, most = sensor.full_scale_voltage, scale = most / sensor.full_scale;
  run_filter(sensor.filter, sensor.motion.at + begin, volts + begin, stop - begin);
  for (int64_t n = begin; n < stop; n++) {
    double seen = volts[n] + sensor.noise.at[n];
    if (sensor.instead.size > 0 && sensor.instead.at[n] == sensor.instead.at[n]) seen = sensor.instead.at[n];
    volts[n] = smaller(larger(seen * scale, -most), most);
  }
}

inline int64_t show(const Sensor &sensor) {
  show(sensor, 0, sensor.motion.size);
  return 0;
}

// Adds a controller's delayed output to the drive, from `begin` to the controller's next sample (`stop`).
inline int64_t play_loop(LoopCables &loop) {
  int64_t each = loop.steps_per_sample, into = (loop.first + loop.begin) % each;
  double *late = loop.late.at, *drive = loop.drive.at + loop.begin;
  if (into == 0) {
    double count = larger(loop.steps_heard, 1.0);
    double volts = answer(*loop.controller, loop.base_sum / count, loop.m0_sum / count);
    loop.base_sum = loop.m0_sum = loop.steps_heard = 0.0;
    for (int64_t k = loop.late.size - each; k < loop.late.size; k++) late[k] = volts;
  }
  loop.stop = smaller(loop.begin + each - into, loop.drive.size);
  int64_t count = loop.stop - loop.begin;
  for (int64_t k = 0; k < count; k++) drive[k] += late[k];
  for (int64_t k = count; k < loop.late.size; k++) late[k - count] = late[k];
  for (int64_t k = loop.late.size - count; k < loop.late.size; k++) late[k] = 0.0;
  return loop.stop;
}

// Adds the sensor voltages of the simulated steps to the controller's sums, and moves `begin` to the next
// steps. Returns 1 if the host must act before the controller's next sample.
inline int64_t hear_loop(LoopCables &loop) {
  if (loop.stop < loop.begin || loop.stop > loop.drive.size) return REFUSED;
  show(loop.base, loop.begin, loop.stop);
  show(loop.m0, loop.begin, loop.stop);
  for (int64_t n = loop.begin; n < loop.stop; n++) {
    loop.base_sum += loop.base.volts.at[n];
    loop.m0_sum += loop.m0.volts.at[n];
  }
  loop.steps_heard += double(loop.stop - loop.begin);
  loop.begin = loop.stop;
  return wants_attention(*loop.controller);
}

enum class LoopEnd : int64_t { COMPLETE, NEEDS_ATTENTION, MOTION_LOST };

// Advances sample by sample until the steps end, the motion fails, or the host must act.
inline int64_t close_loop(LoopCables &loop) {
  return with_shaker(*loop.shaker, [&](const auto &move) {
    while (loop.begin < loop.drive.size) {
      int64_t asked = play_loop(loop) - loop.begin, moved = move(loop.begin, loop.stop);
      if (moved < asked) {
        loop.begin += moved;
        return LoopEnd::MOTION_LOST;
      }
      if (hear_loop(loop)) return LoopEnd::NEEDS_ATTENTION;
    }
    return LoopEnd::COMPLETE;
  });
}

}  // namespace vibench
