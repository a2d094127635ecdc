// N doubles in parallel, in as many registers as necessary. Operations follow IEEE 754 in a fixed order, with
// fused multiply-adds only in `fused`. Results therefore do not depend on the width of the registers.
#pragma once
#include "elementary.hpp"

namespace vibench {

// Specialised for each N, because g++ ignores the attribute if the size depends on a template argument.
template <int N> struct LanesTrait;
template <> struct LanesTrait<8> {
  typedef double Lanes __attribute__((vector_size(64)));
};
template <> struct LanesTrait<16> {
  typedef double Lanes __attribute__((vector_size(128)));
};

template <int N> struct Vector {
  using Lanes = typename LanesTrait<N>::Lanes;
  Lanes lanes;

  Vector() = default;
  INLINE Vector(double everywhere) : lanes(everywhere - Lanes{}) {}
  INLINE explicit Vector(Lanes of) : lanes(of) {}
  static INLINE Vector load(const double *from) {
    Vector loaded;
    __builtin_memcpy(&loaded.lanes, from, sizeof loaded.lanes);
    return loaded;
  }
  INLINE void store(double *to) const { __builtin_memcpy(to, &lanes, sizeof lanes); }
  INLINE double operator[](int lane) const { return lanes[lane]; }
  INLINE void set(int lane, double value) { lanes[lane] = value; }

  friend INLINE Vector operator+(Vector a, Vector b) { return Vector(a.lanes + b.lanes); }
  friend INLINE Vector operator-(Vector a, Vector b) { return Vector(a.lanes - b.lanes); }
  friend INLINE Vector operator*(Vector a, Vector b) { return Vector(a.lanes * b.lanes); }
  friend INLINE Vector operator/(Vector a, Vector b) { return Vector(a.lanes / b.lanes); }
  friend INLINE Vector operator-(Vector a) { return Vector(-a.lanes); }
};

// One boolean for each of eight lanes.
struct Mask {
#if defined(__clang__)
  typedef bool Flags __attribute__((ext_vector_type(8)));  // stored in a mask register if the processor has one
  static INLINE Mask of(unsigned bits) { return {__builtin_bit_cast(Flags, uint8_t(bits))}; }
  INLINE unsigned bits() const { return __builtin_bit_cast(uint8_t, flags); }
#else
  typedef int64_t Flags __attribute__((vector_size(64)));
  static INLINE Mask of(unsigned bits) {
    Mask mask;
    for (int i = 0; i < 8; i++) mask.flags[i] = -int64_t(bits >> i & 1);
    return mask;
  }
  INLINE unsigned bits() const {
    unsigned bits = 0;
    for (int i = 0; i < 8; i++) bits |= unsigned(flags[i] & 1) << i;
    return bits;
  }
#endif
  Flags flags;

  friend INLINE Mask operator&(Mask a, Mask b) { return {a.flags & b.flags}; }
  friend INLINE Mask operator|(Mask a, Mask b) { return {a.flags | b.flags}; }
  friend INLINE Mask operator~(Mask a) { return {~a.flags}; }
};

INLINE Mask operator<(Vector<8> a, Vector<8> b) {
#if defined(__clang__)
  return {__builtin_convertvector(a.lanes < b.lanes, Mask::Flags)};
#else
  return {a.lanes < b.lanes};
#endif
}

// Returns `a` where the mask is set, otherwise `b`.
INLINE Vector<8> select(Mask mask, Vector<8> a, Vector<8> b) {
#if defined(__clang__)
  typedef int64_t Whole __attribute__((vector_size(64)));
  return Vector<8>(__builtin_convertvector(mask.flags, Whole) ? a.lanes : b.lanes);
#else
  return Vector<8>(mask.flags ? a.lanes : b.lanes);
#endif
}

INLINE Vector<8> magnitude(Vector<8> x) { return select(x < 0.0, -x, x); }

// Returns a b + c, rounded once. The x86-64 baseline has no such instruction, so its last digits differ.
INLINE Vector<8> fused(Vector<8> a, Vector<8> b, Vector<8> c) {
#if !defined(__FMA__) && !defined(__aarch64__)
  return a * b + c;
#elif defined(__clang__)
  return Vector<8>(__builtin_elementwise_fma(a.lanes, b.lanes, c.lanes));
#else
  for (int i = 0; i < 8; i++) c.lanes[i] = __builtin_fma(a.lanes[i], b.lanes[i], c.lanes[i]);
  return c;
#endif
}

template <int N> INLINE Vector<N> square_root(Vector<N> x) {
#if defined(__clang__)
  return Vector<N>(__builtin_elementwise_sqrt(x.lanes));
#else
  for (int i = 0; i < N; i++) x.lanes[i] = square_root(x.lanes[i]);
  return x;
#endif
}

template <int N> INLINE Vector<N> magnitude(Vector<N> x) {
#if defined(__clang__)
  return Vector<N>(__builtin_elementwise_abs(x.lanes));
#else
  for (int i = 0; i < N; i++) x.lanes[i] = magnitude(x.lanes[i]);
  return x;
#endif
}

// Returns eight successive lanes of `from` and then `to`, beginning with the last or second lane of `from`.
INLINE Vector<8> lanes_before(Vector<8> from, Vector<8> to) {
  return Vector<8>(__builtin_shufflevector(from.lanes, to.lanes, 7, 8, 9, 10, 11, 12, 13, 14));
}
INLINE Vector<8> lanes_behind(Vector<8> from, Vector<8> to) {
  return Vector<8>(__builtin_shufflevector(from.lanes, to.lanes, 1, 2, 3, 4, 5, 6, 7, 8));
}

// Returns the sum of all lanes, by repeated halving.
template <int N> INLINE double total(Vector<N> x) {
  double of[N];
  x.store(of);
  for (int half = N / 2; half > 0; half /= 2)
    for (int i = 0; i < half; i++) of[i] += of[i + half];
  return of[0];
}

template <int N> INLINE double largest(Vector<N> x) {
  double best = x[0];
  for (int i = 1; i < N; i++) best = larger(best, x[i]);
  return best;
}

// Returns the number of leading lanes between `low` and `high`.
INLINE int leading_between(Vector<16> x, double low, double high) {
  auto inside = (x.lanes > Vector<16>(low).lanes) & (x.lanes < Vector<16>(high).lanes);
#if defined(__clang__)
  typedef bool Flags __attribute__((ext_vector_type(16)));
  unsigned flags = __builtin_bit_cast(uint16_t, __builtin_convertvector(inside, Flags));
#else
  unsigned flags = 0;
  for (int i = 0; i < 16; i++) flags |= unsigned(inside[i] & 1) << i;
#endif
  return __builtin_ctz(~flags);
}

}  // namespace vibench
