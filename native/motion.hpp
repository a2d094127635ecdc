// State of a motion between two steps of a run, and the record of the run.
#pragma once
#include "contact.hpp"

namespace vibench {

// State of a run under a power law between its steps.
struct PowerMemory {
  double level;     // level of the next step plus one; 0 before the first step
  double sizes[3];  // recent magnitudes of p, x, z [m]
};

template <class T> struct Motion {
  T at[6];  // x, y, z, vx, vy, vz [m, m/s]
  Clock<T> clock;
  Contact<T> contact;
  PowerMemory powers;
  double growth[6];  // logarithm of the factor removed from each derivative
};

inline Motion<double> motion_of(const State &state) {
  Motion<double> motion;
  __builtin_memcpy(motion.at, state.motion, sizeof motion.at);
  motion.clock = {state.clock_high, state.clock_low, 0.0};
  motion.contact = {state.root,       state.rate,       state.side, state.step,
                    state.root_scale, state.rate_scale, state.pace};
  motion.powers.level = state.level;
  __builtin_memcpy(motion.powers.sizes, state.sizes, sizeof state.sizes);
  for (double &growth : motion.growth) growth = 0.0;
  return motion;
}

inline void keep(State &state, const Motion<double> &motion) {
  __builtin_memcpy(state.motion, motion.at, sizeof motion.at);
  state.clock_high = motion.clock.high, state.clock_low = motion.clock.low;
  const Contact<double> &c = motion.contact;
  state.root = c.w, state.rate = c.r, state.side = c.side, state.step = c.step;
  state.root_scale = c.root_scale, state.rate_scale = c.rate_scale, state.pace = c.pace;
  state.level = motion.powers.level;
  __builtin_memcpy(state.sizes, motion.powers.sizes, sizeof state.sizes);
}

INLINE Motion<double> values_of(const Motion<double> &motion) { return motion; }
template <int M> inline Motion<double> values_of(const Motion<Dual<double, M>> &motion) {
  const auto &c = motion.contact;
  Motion<double> values{{}, {motion.clock.high, motion.clock.low, 0.0}, {}, motion.powers, {}};
  for (int i = 0; i < 6; i++) values.at[i] = motion.at[i].value;
  values.contact = {c.w.value, c.r.value, c.side, c.step, c.root_scale, c.rate_scale, c.pace};
  return values;
}

// Normalises very large or small derivatives, so that products with physical quantities stay finite. Adds the
// logarithm of each removed factor to `growth`. Returns whether a derivative changed.
template <int M> inline bool keep_in_range(Motion<Dual<double, M>> &motion) {
  constexpr double LARGEST = 1e100, SMALLEST = 1e-100;
  bool is_changed = false;
  for (int k = 0; k < M; k++) {
    double size = 0.0;
    for (const auto &number : motion.at) size = larger(size, magnitude(number.slope[k]));
    if (!(size > LARGEST || (size < SMALLEST && size > 0.0)) || !is_finite(size)) continue;
    for (auto &number : motion.at) number.slope[k] /= size;
    motion.contact.w.slope[k] /= size, motion.contact.r.slope[k] /= size, motion.clock.slip.slope[k] /= size;
    motion.growth[k] += logarithm(size);
    is_changed = true;
  }
  return is_changed;
}

constexpr int64_t MOST_STEPS = 2000000000;  // largest number of grid steps of flight in a run
constexpr int64_t RESOLVED_STEP = 50;       // computing time of a contact step, in units of a grid step

// Returns the number of grid steps of a flight; MOST_STEPS if its length or its grid is not finite.
INLINE int64_t steps_of(double length, double grid) {
  double steps = length / grid;
  return steps >= 0.0 && steps < double(MOST_STEPS) ? 1 + int64_t(steps) : MOST_STEPS;
}

// Counts an impact, and stores its time if requested. Returns false if the number of impacts is at its limit.
INLINE bool keep_impact(Record &record, double time) {
  if (record.impacts == record.impact_room) return false;
  if (record.impact_times != nullptr) record.impact_times[record.impacts] = time;
  record.impacts++;
  return true;
}

// Stores the samples of the next `length` seconds. `place_sample(later, sample)` computes one sample.
template <class PlaceSample>
inline void keep_samples(Record &record, const Clock<double> &clock, double length, const PlaceSample &place_sample) {
  while (record.samples_kept < record.sample_room) {
    double later = time_until(clock, record.start + double(record.samples_kept) / record.sample_rate);
    if (later > length) return;
    place_sample(later, record.samples + 6 * record.samples_kept);
    record.samples_kept++;
  }
}

}  // namespace vibench
