// Weighted sums of samples: interpolation, decimation, and filters with a state kept from block to block.
#pragma once
#include "structures.hpp"

namespace vibench {

constexpr int INTERPOLATION_TAPS = 64;
constexpr int INTERPOLATION_REACH = INTERPOLATION_TAPS / 2;  // number of samples on either side

// Computes weighted sums of N ranges that start `stride` apart; each weight is loaded only once. The result
// of a range does not depend on N. `count` is a multiple of eight.
template <int N>
INLINE void inner_products(double (&sums)[N], const double *weights, const double *values, int64_t stride,
                           int64_t count) {
  Vector<8> all[N];
  for (Vector<8> &each : all) each = 0.0;
  for (int64_t k = 0; k < count; k += 8) {
    Vector<8> weight = Vector<8>::load(weights + k);
    for (int n = 0; n < N; n++) all[n] = all[n] + weight * Vector<8>::load(values + n * stride + k);
  }
  for (int n = 0; n < N; n++) sums[n] = total(all[n]);
}
INLINE double inner_product(const double *weights, const double *values, int64_t count) {
  double sums[1];
  inner_products(sums, weights, values, 0, count);
  return sums[0];
}

// Computes the taps for a position `fraction` of a sample after a sample, by cubic Lagrange interpolation.
inline void interpolation_weights(double *weights, const Numbers &table, double fraction) {
  int64_t phases = table.size / INTERPOLATION_TAPS - 3;
  double place = fraction * double(phases);
  int64_t row = smaller(int64_t(place), phases - 1);
  double t = place - double(row);
  double a = -t * (t - 1.0) * (t - 2.0) / 6.0, b = (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0;
  double c = -(t + 1.0) * t * (t - 2.0) / 2.0, d = (t + 1.0) * t * (t - 1.0) / 6.0;
  const double *rows = table.at + row * INTERPOLATION_TAPS;
  for (int k = 0; k < INTERPOLATION_TAPS; k++) {
    const double *tap = rows + k;
    weights[k] = (a * tap[0] + b * tap[INTERPOLATION_TAPS]) +
                 (c * tap[2 * INTERPOLATION_TAPS] + d * tap[3 * INTERPOLATION_TAPS]);
  }
}

inline int64_t interpolate(const Interpolation &of) {
  int64_t size = of.samples.size / of.channels, count = of.positions.size;
  double weights[INTERPOLATION_TAPS], around[INTERPOLATION_TAPS];
  for (int64_t i = 0; i < count; i++) {
    double position = of.positions.at[i], whole = whole_part(position);
    bool reaches = whole >= -INTERPOLATION_REACH && whole < double(size + INTERPOLATION_REACH);
    int64_t begin = reaches ? int64_t(whole) + 1 - INTERPOLATION_REACH : 0;
    bool is_inside = reaches && begin >= 0 && begin + INTERPOLATION_TAPS <= size;
    if (reaches) interpolation_weights(weights, of.table, position - whole);
    for (int64_t channel = 0; channel < of.channels; channel++) {
      const double *samples = of.samples.at + channel * size, *seen = around;
      if (is_inside) seen = samples + begin;
      else
        for (int64_t k = 0; k < INTERPOLATION_TAPS; k++)
          around[k] = begin + k >= 0 && begin + k < size ? samples[begin + k] : 0.0;
      double outside = position == position ? 0.0 : position;
      of.values.at[channel * count + i] = reaches ? inner_product(weights, seen, INTERPOLATION_TAPS) : outside;
    }
  }
  return 0;
}

// Computes the samples; returns REFUSED if a sample needs means that are not available.
inline int64_t decimate(const Decimation &of) {
  constexpr int TOGETHER = 4;
  int64_t rows = of.table.size / of.reach, count = of.samples.size, last = of.means.size - of.reach;
  for (int64_t k = 0; k < count; k++) {
    // Time is counted from sample 0, so results do not depend on the block size.
    double steps = (double(of.first + k) + 1.0) * of.ratio, at = steps + of.begin;
    // A table with one row is valid for one constant fraction of a step, so only whole steps remain.
    double whole = rows == 1 ? steps + whole_part(of.begin) : whole_part(at);
    double start = whole + double(of.origin), place = (at - whole) * double(rows - 1);
    if (!(start >= 0.0 && start <= double(last))) return REFUSED;
    const double *means = of.means.at + int64_t(start);
    if (double(last) - start >= (TOGETHER - 1) * of.ratio && rows == 1 && k + TOGETHER <= count) {
      double sums[TOGETHER];
      inner_products(sums, of.table.at, means, int64_t(of.ratio), of.reach);
      for (int n = 0; n < TOGETHER; n++) of.samples.at[k + n] = sums[n];
      k += TOGETHER - 1;
      continue;
    }
    int64_t row = smaller(int64_t(place), larger(rows - 2, int64_t(0)));
    double part = place - double(row), sum = inner_product(of.table.at + row * of.reach, means, of.reach);
    if (part > 0.0) sum += part * (inner_product(of.table.at + (row + 1) * of.reach, means, of.reach) - sum);
    of.samples.at[k] = sum;
  }
  return 0;
}

inline void run_filter(const RecursiveFilter &filter, const double *values, double *result, int64_t count) {
  const double *numerator = filter.numerator.at, *denominator = filter.denominator.at;
  double *state = filter.state.at;
  for (int64_t n = 0; n < count; n++) {
    double value = values[n], shown = state[0] + numerator[0] * value;
    for (int64_t k = 1; k < filter.state.size; k++)
      state[k - 1] = state[k] + numerator[k] * value - denominator[k] * shown;
    result[n] = shown;
  }
}

inline int64_t filter_signal(const FilteredSignal &of) {
  run_filter(of.filter, of.values.at, of.result.at, of.values.size);
  return 0;
}

}  // namespace vibench
