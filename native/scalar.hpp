// Number types of a motion: `double`, or `Dual<double, M>`, a number with M derivatives. The same templates
// compute a motion and its derivatives, so Lyapunov exponents, Floquet multipliers and Newton matrices need
// no separate code. `Wide<T, N>` is N numbers of type T in vector registers. `Complex<T>` is a phasor.
#pragma once
#include "elementary.hpp"
#include "vector.hpp"

namespace vibench {

// A value and its derivatives in M directions.
template <class R, int M> struct Dual {
  R value;
  R slope[M];
};

template <class> struct DualTrait {
  static constexpr bool is_dual = false;
};
template <class R, int M> struct DualTrait<Dual<R, M>> {
  static constexpr bool is_dual = true;
};
template <class T> constexpr bool is_dual = DualTrait<T>::is_dual;
template <class T>
concept Plain = !is_dual<T>;

// Returns a dual number; slope(i) is its derivative in direction i.
template <int M, class R, class Slope> INLINE Dual<R, M> dual(const R &value, const Slope &slope) {
  Dual<R, M> number;
  number.value = value;
  for (int i = 0; i < M; i++) number.slope[i] = slope(i);
  return number;
}

template <class A, class B, int M> INLINE auto operator+(const Dual<A, M> &x, const Dual<B, M> &y) {
  return dual<M>(x.value + y.value, [&](int i) { return x.slope[i] + y.slope[i]; });
}
template <class A, class B, int M> INLINE auto operator-(const Dual<A, M> &x, const Dual<B, M> &y) {
  return dual<M>(x.value - y.value, [&](int i) { return x.slope[i] - y.slope[i]; });
}
template <class A, class B, int M> INLINE auto operator*(const Dual<A, M> &x, const Dual<B, M> &y) {
  return dual<M>(x.value * y.value, [&](int i) { return x.value * y.slope[i] + x.slope[i] * y.value; });
}
template <int M> INLINE Dual<double, M> operator/(const Dual<double, M> &x, const Dual<double, M> &y) {
  double ratio = x.value / y.value;
  return dual<M>(ratio, [&](int i) { return (x.slope[i] - ratio * y.slope[i]) / y.value; });
}
template <class A, Plain B, int M> INLINE auto operator+(const Dual<A, M> &x, const B &y) {
  return dual<M>(x.value + y, [&](int i) { return x.slope[i]; });
}
template <class A, Plain B, int M> INLINE auto operator+(const B &y, const Dual<A, M> &x) { return x + y; }
template <class A, Plain B, int M> INLINE auto operator-(const Dual<A, M> &x, const B &y) {
  return dual<M>(x.value - y, [&](int i) { return x.slope[i]; });
}
template <class A, Plain B, int M> INLINE auto operator-(const B &y, const Dual<A, M> &x) {
  return dual<M>(y - x.value, [&](int i) { return -x.slope[i]; });
}
template <class A, Plain B, int M> INLINE auto operator*(const Dual<A, M> &x, const B &y) {
  return dual<M>(x.value * y, [&](int i) { return x.slope[i] * y; });
}
template <class A, Plain B, int M> INLINE auto operator*(const B &y, const Dual<A, M> &x) { return x * y; }
template <int M> INLINE Dual<double, M> operator/(const Dual<double, M> &x, double y) {
  return dual<M>(x.value / y, [&](int i) { return x.slope[i] / y; });
}
template <class A, int M> INLINE Dual<A, M> operator-(const Dual<A, M> &x) { return 0.0 - x; }

// Returns f(x) with its derivatives, from the values of f and of df/dx.
template <Plain R> INLINE R chained(const R &value, const R &, const R &) { return value; }
template <class R, int M> INLINE Dual<R, M> chained(const R &value, const R &rate, const Dual<R, M> &x) {
  return dual<M>(value, [&](int i) { return rate * x.slope[i]; });
}
template <class R, int M> INLINE Dual<R, M> square_root(const Dual<R, M> &x) {
  R root = square_root(x.value);
  return chained(root, 0.5 / root, x);
}

// Returns the value without derivatives. All decisions (touch, step, end of an iteration) use only values.
template <Plain A> INLINE A value_of(const A &x) { return x; }
template <class A, int M> INLINE A value_of(const Dual<A, M> &x) { return x.value; }

// Returns a number with zero derivatives.
template <class T> INLINE T constant(double value) {
  T number{};
  if constexpr (is_dual<T>) number.value = value;
  else number = value;
  return number;
}

// Returns a number with the same derivatives and the value zero; zero for a plain number.
template <class T> INLINE T slopes_only(T x) {
  if constexpr (is_dual<T>) x.value = 0.0;
  else x = 0.0;
  return x;
}

// ---- N numbers in parallel

template <class T, int N> struct WideTrait;
template <int N> struct WideTrait<double, N> {
  using type = Vector<N>;
};
template <int N, int M> struct WideTrait<Dual<double, M>, N> {
  using type = Dual<Vector<N>, M>;
};
template <class T, int N> using Wide = typename WideTrait<T, N>::type;

template <int N, int M> INLINE Dual<double, M> total(const Dual<Vector<N>, M> &x) {
  return dual<M>(total(x.value), [&](int i) { return total(x.slope[i]); });
}
template <int N> INLINE double at(const Vector<N> &x, int lane) { return x[lane]; }
template <int N, int M> INLINE Dual<double, M> at(const Dual<Vector<N>, M> &x, int lane) {
  return dual<M>(x.value[lane], [&](int i) { return x.slope[i][lane]; });
}
template <int N> INLINE Vector<N> gathered(const double (&from)[N]) { return Vector<N>::load(from); }
template <int M, int N> INLINE Dual<Vector<N>, M> gathered(const Dual<double, M> (&from)[N]) {
  Dual<Vector<N>, M> all;
  for (int k = 0; k < N; k++) {
    all.value.set(k, from[k].value);
    for (int i = 0; i < M; i++) all.slope[i].set(k, from[k].slope[i]);
  }
  return all;
}

// Returns the sum over k of x_k table[k], for K rows of N numbers. Even and odd rows are summed separately:
// two short chains of dependent sums take half the time of one chain.
template <int N, int K> INLINE Vector<N> times(const double (*table)[N], const Vector<K> &x) {
  Vector<N> even = x[0] * Vector<N>::load(table[0]), odd = x[1] * Vector<N>::load(table[1]);
  for (int k = 2; k < K; k += 2) {
    even = even + x[k] * Vector<N>::load(table[k]);
    odd = odd + x[k + 1] * Vector<N>::load(table[k + 1]);
  }
  return even + odd;
}
template <int N, int K, int M>
INLINE Dual<Vector<N>, M> times(const double (*table)[N], const Dual<Vector<K>, M> &x) {
  return dual<M>(times(table, x.value), [&](int i) { return times(table, x.slope[i]); });
}

// ---- Phasors

template <class T> struct Complex {
  T re, im;
};
using Phasor = Complex<double>;

template <class A, class B> INLINE auto operator*(const Complex<A> &x, const Complex<B> &y) {
  auto re = x.re * y.re - x.im * y.im;
  return Complex<decltype(re)>{re, x.re * y.im + x.im * y.re};
}
template <class A> INLINE Complex<A> operator*(double x, const Complex<A> &y) { return {x * y.re, x * y.im}; }
template <class A> INLINE Complex<A> operator+(const Complex<A> &x, const Complex<A> &y) {
  return {x.re + y.re, x.im + y.im};
}
template <class A> INLINE Complex<A> operator-(const Complex<A> &x, const Complex<A> &y) {
  return {x.re - y.re, x.im - y.im};
}
template <class A> INLINE Complex<A> conjugate(const Complex<A> &x) { return {x.re, -x.im}; }
INLINE Phasor quotient(const Phasor &x, const Phasor &y) {
  return (1.0 / (y.re * y.re + y.im * y.im)) * (x * conjugate(y));
}
INLINE double magnitude(const Phasor &x) { return square_root(x.re * x.re + x.im * x.im); }
// Returns Re(x y).
template <class A> INLINE A real_of_product(const Complex<A> &x, const Phasor &y) { return x.re * y.re - x.im * y.im; }

template <class R, int M>
INLINE Complex<Dual<R, M>> chained(const Complex<R> &value, const Complex<R> &rate, const Dual<R, M> &x) {
  return {chained(value.re, rate.re, x), chained(value.im, rate.im, x)};
}

// exp(i angle), and exp(rate time) with derivatives by the chain rule.
INLINE Phasor turned_by(double angle) {
  auto [cosine, sine] = cosine_sine(angle);
  return {cosine, sine};
}
INLINE Phasor grown(const Phasor &rate, double time) {
  return exponential(rate.re * time) * turned_by(rate.im * time);
}
template <int M> INLINE Complex<Dual<double, M>> grown(const Phasor &rate, const Dual<double, M> &time) {
  Phasor now = grown(rate, time.value);
  return chained(now, now * rate, time);
}

}  // namespace vibench
