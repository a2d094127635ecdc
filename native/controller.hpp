// One sample of a real-time controller: phase, Fourier series, control law, and measured coefficients.
#pragma once
#include "structures.hpp"

namespace vibench {

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

}  // namespace vibench
