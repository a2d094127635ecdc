// Flight (motion without contact) under a harmonic drive up to the first touch, exact (decision 0004). Each
// displacement is Re sum a_j V_j exp(l_j t) over the modes of eq. 1 without F, with the drive as the last
// term. The search for a touch computes only p, sixteen grid steps at once (decision 0008).
#pragma once
#include "clock.hpp"
#include "detection.hpp"

namespace vibench {

constexpr int RUN_OF_STEPS = 512;  // steps by multiplication between uses of exp; rounding stays below 1e-13
constexpr double LARGEST_BOUND = 1e150;  // above this bound squares overflow, and touches cannot be detected

// Returns the drive's phasor at the clock time plus `later`.
template <class T> INLINE Complex<T> drive_phasor(const Clock<T> &clock, const T &later, const Tables &t) {
  Phasor now = turned_by(angle_at(clock.high, clock.low, value_of(later), t.drive.frequency)) * t.drive.start;
  if constexpr (is_dual<T>) {
    Phasor change = now * Phasor{0.0, t.omega};
    T passed = later + clock.slip;
    Complex<T> all;
    all.re.value = now.re, all.im.value = now.im;
    for (size_t i = 0; i < sizeof passed.slope / sizeof(double); i++)
      all.re.slope[i] = change.re * passed.slope[i], all.im.slope[i] = change.im * passed.slope[i];
    return all;
  } else {
    return now;
  }
}

// Computes the phasors of the linear motion that starts from `motion`.
template <class T>
inline void start_flight(Complex<T> *phasors, const T *motion, const Complex<T> &drive, const LinearTables &t) {
  T free[6];  // deviation from the steady motion
  for (int i = 0; i < 6; i++) free[i] = motion[i] - real_of_product(drive, t.shapes[t.modes][i]);
  for (int j = 0; j < t.modes; j++) {
    T re = free[0] * t.rows[j][0].re, im = free[0] * t.rows[j][0].im;
    for (int i = 1; i < 6; i++) {
      re = re + free[i] * t.rows[j][i].re;
      im = im + free[i] * t.rows[j][i].im;
    }
    phasors[j] = {re, im};
  }
  phasors[t.modes] = drive;
}

template <class T>
inline void propagate(Complex<T> *turned, const Complex<T> *phasors, const T &later, const Complex<T> &drive,
                      const LinearTables &t) {
  for (int j = 0; j < t.modes; j++) turned[j] = phasors[j] * grown(t.rates[j], later);
  turned[t.modes] = drive;
}

template <class T> inline void place(T *motion, const Complex<T> *phasors, const LinearTables &t) {
  for (int i = 0; i < 6; i++) {
    T sum = real_of_product(phasors[0], t.shapes[0][i]);
    for (int j = 1; j <= t.modes; j++) sum = sum + real_of_product(phasors[j], t.shapes[j][i]);
    motion[i] = sum;
  }
}

template <class T> INLINE void copy_values(Phasor *values, const Complex<T> *phasors, const LinearTables &t) {
  for (int j = 0; j <= t.modes; j++) values[j] = {value_of(phasors[j].re), value_of(phasors[j].im)};
}

// One displacement as N phasors. Its bounds stay valid later, because free phasors only decay.
template <int N> struct PhasorSum {
  const LinearTables &tables;
  Phasor terms[N];
  double reach = 0.0;  // bound of the displacement [m]
  double bound = 0.0;  // bound of its acceleration [m/s^2]

  INLINE PhasorSum(const Phasor *phasors, const Phasor *shape, const LinearTables &t) : tables(t) {
    for (int j = 0; j < N; j++) {
      terms[j] = j <= t.modes ? phasors[j] * shape[j] : Phasor{0.0, 0.0};
      double size = magnitude(terms[j]);
      reach += size;
      bound += size * t.squares[j];
    }
  }
  INLINE double now() const {
    double sum = terms[0].re;
    for (int j = 1; j < N; j++) sum += terms[j].re;
    return sum;
  }
  INLINE Vector<AHEAD> rows(const double (&of)[PHASORS][2][AHEAD]) const {
    Vector<AHEAD> sum = terms[0].re * Vector<AHEAD>::load(of[0][REAL]) - terms[0].im * Vector<AHEAD>::load(of[0][IMAG]);
    for (int j = 1; j < N; j++)
      sum = sum + (terms[j].re * Vector<AHEAD>::load(of[j][REAL]) - terms[j].im * Vector<AHEAD>::load(of[j][IMAG]));
    return sum;
  }
  INLINE void turn(int steps) {
    for (int j = 0; j < N; j++)
      terms[j] = terms[j] * Phasor{tables.ahead[j][REAL][steps - 1], tables.ahead[j][IMAG][steps - 1]};
  }
  // Advances by grid steps while low < sum < high; returns the number of steps.
  INLINE int march(int steps, double low, double high) {
    int made = 0;
    while (made < steps) {
      int inside = smaller(leading_between(rows(tables.ahead), low, high), steps - made);
      if (inside > 0) turn(inside);
      made += inside;
      if (inside < AHEAD) break;
    }
    return made;
  }
};

// Returns the number of whole grid steps in a time, at most `most`.
INLINE int whole_steps(double time, double grid, int most) { return int(smaller(double(most), time / grid)); }

enum class FlightEnd { CLEAR, TOUCHES, LOST };
struct Flight {
  FlightEnd ends;
  double length;  // [s]
};

template <int N>
inline Flight flight_of(const Phasor *phasors, const Clock<double> &clock, double longest, const Tables &tables) {
  const LinearTables &t = tables.flight;
  double h = t.grid, elapsed = 0.0;
  Room room{tables.specimen.lower_gap, tables.specimen.upper_gap, 0.0, 0.0};
  Phasor now[PHASORS];
  while (elapsed < longest) {
    if (elapsed > 0.0) propagate(now, phasors, elapsed, drive_phasor(clock, elapsed, tables), t);
    else __builtin_memcpy(now, phasors, (t.modes + 1) * sizeof(Phasor));
    PhasorSum<N> p(now, t.path, t);
    room.bound = p.bound, room.reach = p.reach;
    if (p.reach < room.nearer()) return {FlightEnd::CLEAR, longest};
    if (!(p.bound < LARGEST_BOUND)) return {FlightEnd::LOST, elapsed};
    double margin = p.bound * h * h / 8.0, low = margin - room.lower, high = room.upper - margin, begun = elapsed;
    for (int made = 0; made < RUN_OF_STEPS && elapsed < longest;) {
      if (double at = p.now(); low < at && at < high) {
        int steps = whole_steps(longest - elapsed, h, RUN_OF_STEPS - made), ran = p.march(steps, low, high);
        made += ran;
        elapsed = begun + made * h;
        if (ran == steps && steps > 0) continue;
      }
      double length = smaller(h, longest - elapsed), series[AHEAD];
      p.rows(t.series).store(series);
      double touch = first_touch(series, length, room);
      if (touch != NEVER) return {FlightEnd::TOUCHES, elapsed + touch};
      if (length < h) return {FlightEnd::CLEAR, longest};
      p.turn(1);
      made++;
      elapsed = begun + made * h;
    }
  }
  return {FlightEnd::CLEAR, longest};
}

// Follows a flight from `phasors` at the clock time to the first touch, or for `longest` seconds.
inline Flight fly(const Phasor *phasors, const Clock<double> &clock, double longest, const Tables &tables) {
  // Usually there are three modes, one per conjugate pair. Above critical damping a pair becomes two modes.
  if (tables.flight.modes == 3) return flight_of<4>(phasors, clock, longest, tables);
  return flight_of<PHASORS>(phasors, clock, longest, tables);
}

}  // namespace vibench
