// Hidden-state estimation from two channels: a Kalman filter and a backward smoother. The notation of the
// equations is explained in docs/hidden-motion.md.
#pragma once
#include "tracking.hpp"

namespace vibench {

constexpr int MOST_PARAMETERS = 16;
constexpr int MOST_STATES = TRACKED + MOST_PARAMETERS;

using StateRow = Vector<TRACKED>;

// Replaces the covariance P by F P F' + Q. Parameters are constant, so only rows of tracked states change. Q
// is the process noise of the step, plus the variance due to an unknown force that is constant over the step.
INLINE void spread(double *covariance, const double (&whole)[TRACKED][MOST_STATES], const MotionFilter &f,
                   double force_variance, int size) {
  double product[TRACKED][MOST_STATES], turned[MOST_STATES][TRACKED];
  for (int i = 0; i < TRACKED; i++) {
    for (int j = 0; j < size; j++) product[i][j] = 0.0, turned[j][i] = whole[i][j];
    for (int n = 0; n < size; n++)
      for (int j = 0; j < size; j++) product[i][j] += whole[i][n] * covariance[n * size + j];
  }
  for (int i = 0; i < TRACKED; i++) {
    for (int j = TRACKED; j < size; j++) covariance[i * size + j] = covariance[j * size + i] = product[i][j];
    StateRow row = StateRow::load(f.noise.at + i * size) +
                   (force_variance * f.force_input.at[i]) * StateRow::load(f.force_input.at);
    for (int n = 0; n < size; n++) row = row + product[i][n] * StateRow::load(turned[n]);
    for (int j = i; j < TRACKED; j++) covariance[i * size + j] = covariance[j * size + i] = row[j];
  }
}

// Adds the variance due to an error of the impulse between m1 and m2 [N s].
INLINE void add_impulse_error(double *covariance, double error, const TrackedStop &stop, int size) {
  double of_m1 = error * stop.inverse_m1, of_m2 = error * stop.inverse_m2;
  covariance[VY * size + VY] += of_m1 * of_m1;
  covariance[VZ * size + VZ] += of_m2 * of_m2;
  covariance[VY * size + VZ] -= of_m1 * of_m2;
  covariance[VZ * size + VY] = covariance[VY * size + VZ];
}

// Updates the state with one sample; the measured velocity of m0 is X' + W.
INLINE void correct(double *state, double *covariance, double innovation, double variance, int size) {
  double gain[MOST_STATES];
  for (int i = 0; i < size; i++)
    gain[i] = (covariance[i * size + VX] + covariance[i * size + BASE_VELOCITY]) / variance;
  for (int i = 0; i < size; i++) {
    state[i] += gain[i] * innovation;
    for (int j = 0; j < size; j++) covariance[i * size + j] -= gain[i] * gain[j] * variance;
  }
}

INLINE StepModel step_model(const MotionFilter &f, int number) {
  return {reinterpret_cast<const StepFlow *>(f.flows.at)[number],
          reinterpret_cast<const StepFlow *>(f.small_flows.at)[number],
          reinterpret_cast<const TrackedStop *>(f.stops.at)[number], f.step, f.small_steps};
}

INLINE int64_t filter_samples(MotionFilter &f, int size) {
  int parameters = size - TRACKED;
  double *state = f.state.at, *covariance = f.covariance.at;
  StepModel model = step_model(f, 0);
  double jacobian[TRACKED][TRACKED], whole[TRACKED][MOST_STATES];
  for (int64_t k = 0; k < f.velocity.size; k++) {
    double base = f.acceleration.at[k], rise = f.acceleration.at[k + 1] - base, impulse, ignored;
    double moved[TRACKED], varied[TRACKED];
    __builtin_memcpy(moved, state, sizeof moved);
    StepKind kind = step_on<StateAndJacobian>(moved, model, base, rise, impulse, jacobian);
    for (int i = 0; i < TRACKED; i++)
      for (int j = 0; j < TRACKED; j++) whole[i][j] = jacobian[i][j];
    for (int n = 0; n < parameters; n++) {
      __builtin_memcpy(varied, state, sizeof varied);
      step_on<double>(varied, step_model(f, n + 1), base, rise, ignored, jacobian);
      for (int i = 0; i < TRACKED; i++) whole[i][TRACKED + n] = (varied[i] - moved[i]) / f.deviations.at[n];
    }
    for (int i = 0; i < TRACKED; i++) {
      double shift = 0.0;
      for (int j = TRACKED; j < size; j++) shift += whole[i][j] * state[j];
      state[i] = moved[i] + shift;
    }
    spread(covariance, whole, f, f.force_variance.at[k], size);
    if (kind != FLIGHT) add_impulse_error(covariance, f.impulse_share * impulse, model.stop, size);
    double innovation = f.velocity.at[k] - state[VX] - state[BASE_VELOCITY];
    const double *of_m0 = covariance + VX * size, *of_base = covariance + BASE_VELOCITY * size;
    double variance =
        of_m0[VX] + 2.0 * of_m0[BASE_VELOCITY] + of_base[BASE_VELOCITY] + f.velocity_variance;
    // A sample is not used if m1 is in contact or if the velocity was not measured.
    bool is_used = kind != IN_CONTACT && is_finite(innovation);
    if (const TrackRecord &kept = f.record; kept.states.size > 0) {
      __builtin_memcpy(kept.states.at + k * TRACKED, state, sizeof moved);
      __builtin_memcpy(kept.covariances.at + k * TRACKED * TRACKED, covariance, sizeof jacobian);
      if (kind != FLIGHT) __builtin_memcpy(kept.jacobians.at + k * TRACKED * TRACKED, jacobian, sizeof jacobian);
      kept.kinds.at[k] = kind, kept.impulses.at[k] = impulse;
      kept.innovations.at[2 * k] = innovation, kept.innovations.at[2 * k + 1] = is_used ? variance : 0.0;
    }
    if (!is_used) continue;
    f.level += f.level_share * (innovation * innovation / variance - f.level);
    if (!(f.level < f.limit)) return k;
    correct(state, covariance, innovation, variance, size);
  }
  return f.velocity.size;
}

// Filters the samples. Returns the number of samples before the filter lost the motion.
inline int64_t filter_motion(MotionFilter &f) {
  // Without parameters all sizes are known at compile time, which halves the run time.
  return f.state.size == TRACKED ? filter_samples(f, TRACKED) : filter_samples(f, int(f.state.size));
}

// ---- Smoother of Bryson and Frazier, modified (Bierman, Factorization Methods, 1977, X.3)

struct StateMatrix {
  StateRow rows[TRACKED];

  static INLINE StateMatrix load(const double *from, int stride = TRACKED) {
    StateMatrix loaded;
    for (int i = 0; i < TRACKED; i++) loaded.rows[i] = StateRow::load(from + i * stride);
    return loaded;
  }
  INLINE void add(int i, int j, double value) { rows[i].set(j, rows[i][j] + value); }
};

// Returns the row x' A.
INLINE StateRow operator*(const StateRow &x, const StateMatrix &a) {
  StateRow sum = x[0] * a.rows[0];
  for (int i = 1; i < TRACKED; i++) sum = sum + x[i] * a.rows[i];
  return sum;
}
INLINE StateMatrix transposed(const StateMatrix &a) {
  StateMatrix turned;
  for (int i = 0; i < TRACKED; i++)
    for (int j = 0; j < TRACKED; j++) turned.rows[i].set(j, a.rows[j][i]);
  return turned;
}
INLINE double inner_product(const StateRow &x, const StateRow &y) { return total(x * y); }

// Propagates the adjoint and its matrix M backwards over a step with the Jacobian F: F' adjoint, F' M F.
INLINE void carry_back(StateRow &adjoint, StateMatrix &matrix, const StateMatrix &step) {
  adjoint = adjoint * step;
  StateMatrix product, turned = transposed(step), whole;
  for (int i = 0; i < TRACKED; i++) product.rows[i] = matrix.rows[i] * step;
  for (int i = 0; i < TRACKED; i++) whole.rows[i] = turned.rows[i] * product;
  turned = transposed(whole);
  for (int i = 0; i < TRACKED; i++) matrix.rows[i] = 0.5 * (whole.rows[i] + turned.rows[i]);
}

// Propagates adjoint and M backwards over an update: (I - K H)' M (I - K H) + H' H / S; H selects X' + W.
INLINE void use_back(StateRow &adjoint, StateMatrix &matrix, const StateMatrix &covariance, double innovation,
                     double variance) {
  if (variance == 0.0) return;
  StateRow gain = (1.0 / variance) * (covariance.rows[VX] + covariance.rows[BASE_VELOCITY]);
  StateRow side = gain * matrix;
  double pull = -innovation / variance - inner_product(gain, adjoint);
  double added = inner_product(gain, side) + 1.0 / variance;
  const int seen[] = {VX, BASE_VELOCITY};
  for (int place : seen) {
    adjoint.set(place, adjoint[place] + pull);
    matrix.rows[place] = matrix.rows[place] - side;
    for (int i = 0; i < TRACKED; i++) matrix.add(i, place, -side[i]);
  }
  for (int i : seen)
    for (int j : seen) matrix.add(i, j, added);
}

inline int64_t smooth_motion(const MotionSmoother &s) {
  StateMatrix flow = StateMatrix::load(s.flow.at, TRACKED + 2), matrix;
  StateRow adjoint = 0.0, force_input = StateRow::load(s.force_input.at);
  for (StateRow &row : matrix.rows) row = 0.0;
  int64_t samples = s.record.kinds.size;
  for (int64_t k = samples - 1; k >= 0; k--) {
    constexpr int SQUARE = TRACKED * TRACKED;
    if (k + 1 < samples) {
      bool is_flight = s.record.kinds.at[k + 1] == double(FLIGHT);
      carry_back(adjoint, matrix, is_flight ? flow : StateMatrix::load(s.record.jacobians.at + (k + 1) * SQUARE));
    }
    StateMatrix covariance = StateMatrix::load(s.record.covariances.at + k * SQUARE);
    use_back(adjoint, matrix, covariance, s.record.innovations.at[2 * k], s.record.innovations.at[2 * k + 1]);
    (StateRow::load(s.record.states.at + k * TRACKED) - adjoint * covariance).store(s.states.at + k * TRACKED);
    // Variances of p = y - z and of its rate, from P - P M P.
    const int pairs[2][2] = {{Y, Z}, {VY, VZ}};
    for (int n = 0; n < 2; n++) {
      auto [first, second] = pairs[n];
      StateRow difference = covariance.rows[first] - covariance.rows[second];
      double known = difference[first] - difference[second];
      s.variances.at[2 * k + n] = larger(known - inner_product(difference * matrix, difference), 0.0);
    }
    if (s.forces.size > 0) {
      double variance = s.force_variance.at[k], known = inner_product(force_input * matrix, force_input);
      s.forces.at[2 * k] = -variance * inner_product(force_input, adjoint);
      s.forces.at[2 * k + 1] = larger(variance - variance * variance * known, 0.0);
    }
  }
  for (int i = 0; i < TRACKED; i++) matrix.rows[i].store(s.matrix.at + i * TRACKED);
  return 0;
}

}  // namespace vibench
