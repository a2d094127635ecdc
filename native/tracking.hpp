// One step of the motion for hidden-state estimation. Far from the stops it is exact. Near a stop it consists
// of substeps, in which impulses of the contact force and free motion alternate (docs/hidden-motion.md).
#pragma once
#include "structures.hpp"

namespace vibench {

constexpr int TRACKED = 8;  // number of states without parameters
constexpr int BASE_VELOCITY = 6;  // index of W, after X, Y, Z, VX, VY, VZ relative to the base and before B
constexpr double HERTZ_EXPONENT = 1.5;
constexpr double WATCHED_REACH = 2e-7;  // a step that comes closer to a stop is divided into substeps [m]

enum StepKind { FLIGHT, TOUCHED, IN_CONTACT };  // far from stops; near a stop, ends free; ends in contact

// Matrix from (state, recorded acceleration, its increase over a step) to the state at the step's end.
typedef double StepFlow[TRACKED][TRACKED + 2];

// One component of the state with its derivatives with respect to the state at the start of the step.
using StateAndJacobian = Dual<double, TRACKED>;

// Returns d^exponent for d > 0. The special cases for Hertz and linear stops take a tenth of the time.
INLINE double power(double d, double exponent) {
  if (exponent == HERTZ_EXPONENT) return d * square_root(d);
  return exponent == 1.0 ? d : exponential(exponent * logarithm(d));
}
template <int M> INLINE Dual<double, M> power(const Dual<double, M> &d, double exponent) {
  Dual<double, M> raised;
  raised.value = power(d.value, exponent);
  double rate = exponent * raised.value / d.value;
  for (int i = 0; i < M; i++) raised.slope[i] = rate * d.slope[i];
  return raised;
}

// Adds the impulse of the present stop force over `time` to the velocities. Returns the impulse on m1 [N s].
template <class T> INLINE double kick(T *state, const TrackedStop &stop, double time) {
  T p = state[Y] - state[Z], rate = state[VY] - state[VZ];
  double side = value_of(p) > stop.upper_gap ? 1.0 : value_of(p) < -stop.lower_gap ? -1.0 : 0.0;
  if (side == 0.0) return 0.0;
  T d = side * p - (side > 0.0 ? stop.upper_gap : stop.lower_gap);
  T force = -side * (stop.steepness * power(d, stop.exponent) + stop.spring * d) * (1.0 + side * stop.loss * rate);
  T impulse = time * force;
  state[VY] = state[VY] + stop.inverse_m1 * impulse;
  state[VZ] = state[VZ] - stop.inverse_m2 * impulse;
  return value_of(impulse);
}

// Advances a state exactly, without stops. The base acceleration grows linearly by `rise` from `base`.
template <class T> INLINE void flow_on(T *state, const StepFlow &flow, double base, double rise) {
  T moved[TRACKED];
  for (int i = 0; i < TRACKED; i++) {
    moved[i] = constant<T>(flow[i][TRACKED] * base + flow[i][TRACKED + 1] * rise);
    for (int j = 0; j < TRACKED; j++) moved[i] = moved[i] + flow[i][j] * state[j];
  }
  for (int i = 0; i < TRACKED; i++) state[i] = moved[i];
}

struct StepModel {
  const StepFlow &flow, &small_flow;
  const TrackedStop &stop;
  double step;  // [s]
  int64_t small_steps;
};

// Advances a state over substep `n` of a step, and returns the impulse on m1 [N s].
template <class T> INLINE double small_step(T *state, const StepModel &m, double base, double rise, int64_t n) {
  double parts = double(m.small_steps), half = 0.5 * (m.step / parts);
  double impulse = kick(state, m.stop, half);
  flow_on(state, m.small_flow, base + rise * double(n) / parts, rise / parts);
  return impulse + kick(state, m.stop, half);
}

// Returns whether a flight comes near a stop: at its ends, or in the middle of the cubic between them.
inline bool reaches_stop(const double *before, const double *after, const StepModel &m) {
  double p0 = before[Y] - before[Z], p1 = after[Y] - after[Z];
  double bend = 0.125 * m.step * ((before[VY] - before[VZ]) - (after[VY] - after[VZ]));
  double middle = 0.5 * (p0 + p1) + bend;
  double high = larger(larger(p0, p1), middle), low = smaller(smaller(p0, p1), middle);
  return high + WATCHED_REACH > m.stop.upper_gap || -low + WATCHED_REACH > m.stop.lower_gap;
}

// Advances a state by one sample, and computes the impulse on m1. The type T may include derivatives.
template <class T>
inline StepKind step_on(double *state, const StepModel &m, double base, double rise, double &impulse,
                        double (&jacobian)[TRACKED][TRACKED]) {
  double flown[TRACKED];
  __builtin_memcpy(flown, state, sizeof flown);
  flow_on(flown, m.flow, base, rise);
  impulse = 0.0;
  bool is_flight = !reaches_stop(state, flown, m);
  if (is_flight) {
    __builtin_memcpy(state, flown, sizeof flown);
    for (int i = 0; i < TRACKED; i++)
      for (int j = 0; j < TRACKED; j++) jacobian[i][j] = m.flow[i][j];
    return FLIGHT;
  }
  T moved[TRACKED];
  for (int i = 0; i < TRACKED; i++) {
    moved[i] = constant<T>(state[i]);
    if constexpr (is_dual<T>) moved[i].slope[i] = 1.0;
  }
  for (int64_t n = 0; n < m.small_steps; n++) impulse += small_step(moved, m, base, rise, n);
  for (int i = 0; i < TRACKED; i++) {
    state[i] = value_of(moved[i]);
    if constexpr (is_dual<T>)
      for (int j = 0; j < TRACKED; j++) jacobian[i][j] = moved[i].slope[j];
  }
  double p = state[Y] - state[Z];
  return p > m.stop.upper_gap || -p > m.stop.lower_gap ? IN_CONTACT : TOUCHED;
}

// A row of `ContactSearch::contacts`.
struct TrackedContact {
  double touch;        // time of the touch [samples]
  double duration;     // [s]
  double side;         // -1 or +1
  double impulse;      // magnitude of the impulse on m1 [N s]
  double penetration;  // largest penetration [m]
  double before, after;  // approach and rebound speed of p [m/s]
};
constexpr int CONTACT_COLUMNS = sizeof(TrackedContact) / sizeof(double);

// Simulates each contact from the last smoothed state before it. Returns the number of contacts.
inline int64_t follow_contacts(const ContactSearch &of) {
  const auto &flow = *reinterpret_cast<const StepFlow *>(of.small_flow.at);
  const auto &stop = *reinterpret_cast<const TrackedStop *>(of.stop.at);
  auto *found = reinterpret_cast<TrackedContact *>(of.contacts.at);
  StepModel model{flow, flow, stop, of.step, of.small_steps};
  int64_t samples = of.touched.size, room = of.contacts.size / CONTACT_COLUMNS, count = 0, ready = 1;
  double parts = double(of.small_steps);
  for (int64_t k = 1; k < samples && count < room; k++) {
    const double *before = of.states.at + (k - 1) * TRACKED;
    double p = before[Y] - before[Z];
    if (of.touched.at[k] == 0.0 || k < ready || p > stop.upper_gap || -p > stop.lower_gap) continue;
    double state[TRACKED];
    __builtin_memcpy(state, before, sizeof state);
    TrackedContact now{};
    int64_t at = k - 1;
    for (bool is_over = false; !is_over && at + 1 < of.acceleration.size && at - k < of.longest; at++) {
      double base = of.acceleration.at[at], rise = of.acceleration.at[at + 1] - base;
      for (int64_t n = 0; n < of.small_steps && count < room; n++) {
        double last = state[Y] - state[Z], rate = state[VY] - state[VZ], place = double(at) + double(n) / parts;
        double impulse = small_step(state, model, base, rise, n);
        p = state[Y] - state[Z];
        if (now.side == 0.0 && (p > stop.upper_gap || -p > stop.lower_gap)) {
          now.side = p > 0.0 ? 1.0 : -1.0;
          double gap = now.side > 0.0 ? stop.upper_gap : stop.lower_gap;
          now.touch = place + (gap - now.side * last) / (now.side * (p - last)) / parts;
          now.before = now.side * rate;
        }
        if (now.side == 0.0) continue;
        double gap = now.side > 0.0 ? stop.upper_gap : stop.lower_gap;
        now.impulse += magnitude(impulse);
        now.penetration = larger(now.penetration, now.side * p - gap);
        if (now.side * p > gap) continue;
        double end = place + (now.side * last - gap) / (now.side * (last - p)) / parts;
        now.duration = (end - now.touch) * of.step;
        now.after = -now.side * (state[VY] - state[VZ]);
        found[count++] = now;
        now = {};
        is_over = n + 1 == of.small_steps || at + 1 >= samples;
      }
      // A sample that ends without contact ends the search; the next contact starts from a smoothed state.
      is_over = is_over || now.side == 0.0;
    }
    ready = at + 1;
  }
  return count;
}

}  // namespace vibench
