// Growth of the tangent vectors of a motion, for Lyapunov exponents and Floquet multipliers. Between readings
// they are integrated exactly, as dual numbers. At a reading they are made orthonormal in a metric, and the
// logarithms of the removed factors are stored (Benettin et al., Meccanica 15 (1980) 9 and 21).
#pragma once
#include "run.hpp"

namespace vibench {

// ---- Conversion between rows of tangent vectors and dual numbers

// The derivatives of w and r in a contact follow from displacements and velocities, with |p| = gap + w^2.
template <int M> inline Motion<Dual<double, M>> with_changes(const Motion<double> &plain, const Tangent &tangent) {
  Motion<Dual<double, M>> motion{};
  for (int i = 0; i < 6; i++) motion.at[i].value = plain.at[i];
  motion.clock.high = plain.clock.high, motion.clock.low = plain.clock.low;
  const Contact<double> &c = plain.contact;
  auto &contact = motion.contact;
  contact.side = c.side, contact.step = c.step;
  contact.root_scale = c.root_scale, contact.rate_scale = c.rate_scale, contact.pace = c.pace;
  contact.w.value = c.w, contact.r.value = c.r;
  motion.powers = plain.powers;
  for (int k = 0; k < M && k < int(tangent.changes); k++) {
    const double(&row)[6] = tangent.rows[k];
    for (int i = 0; i < 6; i++) motion.at[i].slope[k] = row[i];
    motion.growth[k] = tangent.growth[k];
    contact.w.slope[k] = c.w > 0.0 ? 0.5 * c.side * (row[Y] - row[Z]) / c.w : 0.0;
    contact.r.slope[k] = c.side * (row[VY] - row[VZ]);
  }
  return motion;
}

template <int M> inline void keep_changes(Tangent &tangent, const Motion<Dual<double, M>> &motion) {
  for (int k = 0; k < M && k < int(tangent.changes); k++) {
    for (int i = 0; i < 6; i++) tangent.rows[k][i] = motion.at[i].slope[k];
    tangent.growth[k] = motion.growth[k];
  }
}

// ---- QR step for the exponents: modified Gram-Schmidt. Two passes suffice (Giraud, Langou and Rozloznik,
// Comput. Math. Appl. 50 (2005) 1069).

constexpr int ORTHOGONAL_PASSES = 2;
constexpr double DIRECTION_LOST = 1e-11;  // a row with at most this part of its length left has no direction

using Metric = double[6][6];

inline double inner(const double (&a)[6], const double (&b)[6], const Metric &metric) {
  double sum = 0.0;
  for (int i = 0; i < 6; i++) {
    double part = 0.0;
    for (int j = 0; j < 6; j++) part += metric[i][j] * b[j];
    sum += a[i] * part;
  }
  return sum;
}

// Removes from row `i` its components along the earlier rows; returns the remaining length.
inline double left_of(double (&rows)[6][6], int i, const Metric &metric) {
  for (int pass = 0; pass < ORTHOGONAL_PASSES; pass++)
    for (int j = 0; j < i; j++) {
      double along = inner(rows[j], rows[i], metric);
      for (int k = 0; k < 6; k++) rows[i][k] -= along * rows[j][k];
    }
  return square_root(inner(rows[i], rows[i], metric));
}

// Makes rows orthonormal, and adds the logarithms of their divisors to `logarithms`. A row that depends
// linearly on earlier rows (two after an impact without rebound) gets minus infinity, and is set to an axis.
inline void orthonormalise(double (&rows)[6][6], int count, const Metric &metric, double *logarithms) {
  for (int i = 0; i < count; i++) {
    double whole = square_root(inner(rows[i], rows[i], metric)), length = left_of(rows, i, metric);
    if (!(length > DIRECTION_LOST * whole) && is_finite(whole)) {
      logarithms[i] = -INFINITE;
      for (int axis = 0; axis < 6; axis++) {
        for (int k = 0; k < 6; k++) rows[i][k] = k == axis ? 1.0 / square_root(metric[axis][axis]) : 0.0;
        length = left_of(rows, i, metric);
        if (length * length * 6.0 > 0.5) break;  // true for at least one axis
      }
    } else {
      logarithms[i] += logarithm(length);
    }
    for (double &number : rows[i]) number /= length;
  }
}

// ---- Readings

// Takes all remaining readings up to `last`; `advance(until)` advances the motion and its tangent vectors.
template <class Advance>
inline Outcome take_readings(const State &state, const Record &record, Tangent &tangent, Readings &readings,
                             int64_t last, const Advance &advance) {
  int changes = int(tangent.changes);
  for (; readings.made < last; readings.made++) {
    int64_t k = readings.made, before = record.impacts;
    double *growth = readings.growth + k * changes;
    for (int i = 0; i < changes; i++) growth[i] = 0.0;
    for (int64_t part = 0; part < readings.parts; part++) {
      Outcome outcome = advance((double(k) + double(part + 1) / double(readings.parts)) * readings.interval);
      if (outcome != REACHED_END) return outcome;
      for (int i = 0; i < changes; i++) growth[i] += tangent.growth[i], tangent.growth[i] = 0.0;
      orthonormalise(tangent.rows, changes, readings.metric, growth);
    }
    readings.impacts[k] = record.impacts - before;
    __builtin_memcpy(readings.motions + 6 * k, state.motion, sizeof state.motion);
  }
  return REACHED_END;
}

}  // namespace vibench
