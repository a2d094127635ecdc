// Time as an exact sum of two doubles, so that neither time nor the drive's phase drifts in a long run.
// Dekker, A floating-point technique for extending the available precision, Numer. Math. 18 (1971).
#pragma once
#include "scalar.hpp"

namespace vibench {

// `slip` contains the derivatives of the time, because a perturbed motion touches earlier or later.
template <class T> struct Clock {
  double high, low;
  T slip;
};

template <class T> INLINE void advance(Clock<T> &clock, const T &by) {
  double step = value_of(by), sum = clock.high + step, added = sum - clock.high;
  double low = clock.low + ((clock.high - (sum - added)) + (step - added));
  clock.high = sum + low;
  clock.low = low - (clock.high - sum);
  clock.slip = clock.slip + slopes_only(by);
}

template <class T> INLINE T time_until(const Clock<T> &clock, double instant) {
  return ((instant - clock.high) - clock.low) - clock.slip;
}

// Returns the exact rounding error of a product of two doubles.
INLINE double product_error(double a, double b, double product) {
  constexpr double SPLITTER = 134217729.0;  // 2^27 + 1 splits a double into halves whose products are exact
  double a_big = SPLITTER * a, b_big = SPLITTER * b;
  double a_high = a_big - (a_big - a), b_high = b_big - (b_big - b);
  double a_low = a - a_high, b_low = b - b_high;
  return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
}

// Returns the phase at the clock time plus `later`, in (-2 pi, 4 pi) [rad]; whole turns are removed exactly.
INLINE double angle_at(double high, double low, double later, double frequency) {
  double turns = frequency * high, extra = frequency * later;
  double rest = product_error(frequency, high, turns) + frequency * low;
  return 2.0 * PI * ((turns - whole_part(turns)) + (extra - whole_part(extra)) + rest);
}

}  // namespace vibench
