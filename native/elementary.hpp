// exp, logarithm, sine and cosine from basic operations in a fixed order, which gives the same digits on
// every processor. Argument reduction follows Cody and Waite, Software Manual for the Elementary Functions
// (1980): the constant is split into two or three parts; the first parts are short enough for exact products.
// Errors are below 1.5 units in the last place (native/test_engine.cpp compares with libm).
#pragma once
#include <stddef.h>
#include <stdint.h>

#if defined(__SANITIZE_ADDRESS__)
#define INLINE inline  // g++ takes minutes to compile every inlined copy
#else
#define INLINE inline __attribute__((always_inline))
#endif

namespace vibench {

// Basic functions of numbers. They use neither the C++ library nor libm, so results do not depend on the
// system, and the library loads on every Linux with glibc 2.17 or later (decision 0077).

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

inline double exponential(double x) {
  if (!(x > -708.0)) return x != x ? x : 0.0;
  if (x > 709.0) return INFINITE;
  constexpr double LOG2_HIGH = 6.93147180369123816490e-01, LOG2_LOW = 1.90821492927058770002e-10;
  double twos = nearest(x * 1.44269504088896338700);
  double r = (x - twos * LOG2_HIGH) - twos * LOG2_LOW;  // |r| < 0.35
  double sum = 1.0 / 6227020800.0;                      // 1 / 13!, the last term above rounding error
  constexpr double INVERSE_FACTORIALS[] = {1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880,
                                           1.0 / 40320,     1.0 / 5040,     1.0 / 720,     1.0 / 120,
                                           1.0 / 24,        1.0 / 6,        0.5};
  for (double term : INVERSE_FACTORIALS) sum = sum * r + term;
  sum = (sum * r + 1.0) * r;  // exp(r) - 1; its rounding error is small compared with 1
  double power = __builtin_bit_cast(double, (int64_t(twos) + 1023) << 52);
  return (1.0 + sum) * power;
}

struct CosineSine {
  double cosine, sine;
};

// Returns cos and sin of x + tail for |x| <= pi / 4. Coefficients from Sun's fdlibm, with errors below 2^-58.
INLINE CosineSine cosine_sine_near_zero(double x, double tail) {
  double z = x * x;
  double s = -1.66666666666666324348e-01 +
             z * (8.33333333332248946124e-03 +
                  z * (-1.98412698298579493134e-04 +
                       z * (2.75573137070700676789e-06 +
                            z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10))));
  double c = z * (4.16666666666666019037e-02 +
                  z * (-1.38888888888741095749e-03 +
                       z * (2.48015872894767294178e-05 +
                            z * (-2.75573143513906633035e-07 +
                                 z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  double half = 0.5 * z, near = 1.0 - half;
  double cosine = near + (((1.0 - near) - half) + (z * c - x * tail));
  double sine = x + (tail * (1.0 - half) + x * z * s);
  return {cosine, sine};
}

// Returns cos and sin of any angle [rad]. Above 10^6 rad neither the reduction nor the angle itself is exact.
inline CosineSine cosine_sine(double angle) {
  constexpr double PI_2_HIGH = 1.57079632673412561417e+00;  // 33 bits
  constexpr double PI_2_MIDDLE = 6.07710050630396597660e-11;  // the next 33 bits
  constexpr double PI_2_LOW = 2.02226624879595063154e-21;
  if (!is_finite(angle)) return {angle - angle, angle - angle};
  double quarters = nearest(angle * (2.0 / PI));
  double first = angle - quarters * PI_2_HIGH, second = quarters * PI_2_MIDDLE;
  double x = first - second;
  double tail = ((first - x) - second) - quarters * PI_2_LOW;
  double reduced = x + tail;
  CosineSine of = cosine_sine_near_zero(reduced, (x - reduced) + tail);
  switch (int64_t(magnitude(quarters) < 9e15 ? quarters : 0.0) & 3) {
    case 0: return of;
    case 1: return {-of.sine, of.cosine};
    case 2: return {-of.cosine, -of.sine};
    default: return {of.sine, -of.cosine};
  }
}

// Returns ln x to one unit in the last place; -infinity at 0, NaN below. Coefficients from Sun's fdlibm.
inline double logarithm(double x) {
  constexpr double LN2_HIGH = 6.93147180369123816490e-01, LN2_LOW = 1.90821492927058770002e-10;
  constexpr int64_t ROOT_HALF = 0x3fe6a09e667f3bcd;
  if (!(x > 0.0)) return x == 0.0 ? -INFINITE : NOT_A_NUMBER;
  if (!is_finite(x)) return x;
  double exponent = 0.0;
  if (x < 0x1p-1022) x *= 0x1p54, exponent = -54.0;  // subnormal number
  int64_t bits = __builtin_bit_cast(int64_t, x), whole = (bits - ROOT_HALF) >> 52;
  exponent += double(whole);
  double f = __builtin_bit_cast(double, bits - whole * (int64_t(1) << 52)) - 1.0;  // x = 2^whole (1 + f)
  double s = f / (2.0 + f), z = s * s, half = 0.5 * f * f;
  double r = z * (6.666666666666735130e-01 +
                  z * (3.999999999940941908e-01 +
                       z * (2.857142874366239149e-01 +
                            z * (2.222219843214978396e-01 +
                                 z * (1.818357216161805012e-01 +
                                      z * (1.531383769920937332e-01 + z * 1.479819860511658591e-01))))));
  return exponent * LN2_HIGH - ((half - (s * (half + r) + exponent * LN2_LOW)) - f);
}

}  // namespace vibench
