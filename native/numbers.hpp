// Basic functions of numbers. They use neither the C++ library nor libm, so results do not depend on the
// system, and the library loads on every Linux with glibc 2.17 or later (decision 0077).
#pragma once
#include <stddef.h>
#include <stdint.h>

#if defined(__SANITIZE_ADDRESS__)
#define INLINE inline  // g++ takes minutes to compile every inlined copy
#else
#define INLINE inline __attribute__((always_inline))
#endif

namespace vibench {

constexpr double PI = 3.14159265358979323846;
constexpr double INFINITE = __builtin_inf();
constexpr double NOT_A_NUMBER = __builtin_nan("");
constexpr double EPSILON = 2.220446049250313e-16;  // distance from 1 to the next double

template <class A> constexpr A smaller(A a, A b) { return b < a ? b : a; }
template <class A> constexpr A larger(A a, A b) { return a < b ? b : a; }
INLINE double magnitude(double x) { return __builtin_fabs(x); }
INLINE double square_root(double x) { return __builtin_sqrt(x); }
INLINE double eighth_root(double x) { return square_root(square_root(square_root(x))); }
INLINE bool is_finite(double x) { return magnitude(x) < INFINITE; }  // false for NaN
INLINE double with_sign_of(double size, double sign) { return __builtin_copysign(size, sign); }

// Returns the largest integer not above x. Doubles of at least 2^52 are always integers.
INLINE double whole_part(double x) {
  if (!(magnitude(x) < 4503599627370496.0)) return x;
  double whole = double(int64_t(x));
  return whole > x ? whole - 1.0 : whole;
}

// Returns the nearest integer; halves are rounded up.
INLINE double nearest(double x) { return whole_part(x + 0.5); }

// Returns x^(1/5) for x >= 0: a guess from the exponent, corrected by Newton's method to rounding error.
inline double fifth_root(double x) {
  if (!(x > 0.0) || !is_finite(x)) return x;
  double scale = 1.0;
  if (x < 1e-290) x *= 0x1p300, scale = 0x1p-60;  // subnormal numbers have no usable exponent
  int64_t bits = __builtin_bit_cast(int64_t, x);
  constexpr int64_t ONE = int64_t(1023) << 52;
  double root = __builtin_bit_cast(double, ONE + (bits - ONE) / 5);
  for (int n = 0; n < 5; n++) {
    double square = root * root;
    root += 0.2 * (x / (square * square) - root);
  }
  return root * scale;
}

}  // namespace vibench
