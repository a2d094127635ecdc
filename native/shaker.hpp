// Amplifier, coil, table and specimen under a voltage, step by step (decision 0006). Coil and table are exact
// if voltage and force are constant over a step. A cubic through the table's motion drives the specimen.
#pragma once
#include "cubic.hpp"

namespace vibench {

// Returns the mean output of the amplifier over a step with constant input, before clipping [V].
INLINE double amplified(double volts, LoadedShaker &s) {
  double below = s.low_decay < 1.0 ? volts + (s.low_cut - volts) * s.low_mean : 0.0;
  s.low_cut = volts + (s.low_cut - volts) * s.low_decay;
  double passed = volts - below, mean = passed + (s.high_cut - passed) * s.high_mean;
  s.high_cut = passed + (s.high_cut - passed) * s.high_decay;
  return s.gain * mean;
}

// Returns the force of the rubber stops on the table [N]; they push, but never pull.
INLINE double rubber_force(const LoadedShaker &s) {
  double side = s.base_displacement > 0.0 ? 1.0 : -1.0, pressed_in = side * s.base_displacement - s.stroke;
  if (!(pressed_in > 0.0)) return 0.0;
  return -side * larger(s.stop_stiffness * pressed_in + s.stop_damping * side * s.base_velocity, 0.0);
}

// Advances over steps `begin` to `stop` - 1. Returns their number, or fewer if the specimen's motion failed.
template <class Run>
inline int64_t shake(LoadedShaker &s, Run &run, const Motion<double> &specimen, const Body &body, int64_t begin,
                     int64_t stop) {
  const Specimen &of = body.specimen;
  const double (&t)[3][5] = s.transition;
  double h = s.step;
  for (int64_t n = begin; n < stop; n++) {
    double u0 = s.base_displacement, v0 = s.base_velocity, x0 = specimen.at[X];
    double reaction = of.k0 * (x0 - u0) + of.c0 * (specimen.at[VX] - v0);
    // Mean over the step of the parabola through the last three values (Adams and Bashforth). The value at
    // the start of the step would lag by half a step and supply energy to the table.
    double (&before)[2] = s.reactions_before;
    double force = (23.0 * reaction - 16.0 * before[0] + 5.0 * before[1]) / 12.0, rubber = rubber_force(s);
    before[1] = before[0], before[0] = reaction;
    s.bumps += rubber != 0.0;
    force += rubber;
    double asked = amplified(s.drive.at[n], s), clipped = smaller(larger(asked, -s.clip), s.clip);
    double voltage = clipped + s.noise.at[n];
    double coasting = t[2][0] * u0 + t[2][1] * v0 + t[2][2] * s.current + t[2][4] * force;
    double current = coasting + t[2][3] * voltage;
    if (magnitude(current) > s.current_limit) {
      current = smaller(larger(current, -s.current_limit), s.current_limit);
      voltage = (current - coasting) / t[2][3];
      s.limited_steps++;
    } else {
      s.limited_steps += asked != clipped;
    }
    double u1 = t[0][0] * u0 + t[0][1] * v0 + t[0][2] * s.current + t[0][3] * voltage + t[0][4] * force;
    double v1 = t[1][0] * u0 + t[1][1] * v0 + t[1][2] * s.current + t[1][3] * voltage + t[1][4] * force;
    s.base_displacement = u1, s.base_velocity = v1, s.current = current;
    double mean = (u1 - u0) / h;
    const double base[CUBIC] = {u0, v0, (3.0 * mean - 2.0 * v0 - v1) / h, (v0 + v1 - 2.0 * mean) / (h * h)};
    if (run.advance(base, 0.0, h) != REACHED_END) return n - begin;
    s.amplifier_voltage.at[n] = voltage;
    s.base_acceleration.at[n] = (v1 - v0) / h;
    s.m0_velocity.at[n] = (specimen.at[X] - x0) / h;
    if (9 * n < s.ends.size) {
      const double table[3] = {u1, v1, current};
      __builtin_memcpy(s.ends.at + 9 * n, table, sizeof table);
      __builtin_memcpy(s.ends.at + 9 * n + 3, specimen.at, sizeof specimen.at);
    }
  }
  return stop - begin;
}

// Calls `act` with a function that advances over a range of steps; returns the result of `act`.
template <class Act> inline int64_t with_shaker(LoadedShaker &s, const Act &act) {
  const CubicTables &tables = *reinterpret_cast<const CubicTables *>(s.tables.at);
  Motion<double> specimen = motion_of(s.specimen);
  Record counts{};
  counts.impact_room = INT64_MAX, counts.steps_left = MOST_STEPS;
  int64_t result = 0;
  with_cubic_stops(specimen, tables, s.tolerance, counts, [&](auto &run) {
    result = int64_t(act([&](int64_t begin, int64_t stop) { return shake(s, run, specimen, tables, begin, stop); }));
    return REACHED_END;
  });
  keep(s.specimen, specimen);
  s.impacts += counts.impacts;
  return result;
}

// Advances over all steps, block by block. Returns the number of finished steps.
inline int64_t move_shaker(LoadedShaker &s) {
  int64_t steps = s.drive.size, done = 0;
  for (int64_t k = 0; done < steps; k++) {
    int64_t stop = k < s.begun.size && s.block < steps - done ? done + s.block : steps;
    int64_t moved = with_shaker(s, [&](const auto &move) { return move(done, stop); });
    if (k < s.begun.size) s.begun.at[k] = double(s.impacts);
    if (done + moved < stop) return done + moved;
    done = stop;
  }
  return steps;
}

}  // namespace vibench
