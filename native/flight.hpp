// Flight (motion without contact) under a harmonic drive up to the first touch, exact (decision 0004). Each
// displacement is Re sum a_j V_j exp(l_j t) over the modes of eq. 1 without F, with the drive as the last
// term. The search for a touch computes only p, sixteen grid steps at once (decision 0008).
#pragma once
#include "tables.hpp"

namespace vibench {

// Detection of touches in a flight by a bound of the acceleration of p, without sampling (decision 0004). On
// a stretch of length h, p is a Taylor polynomial (exact to rounding), with |d2p/dt2| <= bound. The stretch
// has no touch if the gaps at both ends exceed bound h^2 / 8. From a gap g with approach speed v, m1 cannot
// reach the stop before 2 g / (v + sqrt(v^2 + 2 bound g)).

constexpr double NEVER = -1.0;
constexpr double TOUCH = 1e-12;              // a gap below this part of the clearance counts as closed
constexpr double ROUNDING = 8.0 * EPSILON;   // a gap below this part of `reach` also counts as closed
constexpr double JUST_SHORT = 0.999;         // rounding margin: factor on the earliest return to the stop
constexpr double SHORTEST_ADVANCE = 1e-15;   // shortest advance [s], so that every search ends
constexpr int TIGHTER_AFTER = 4;             // number of advances after which a tighter bound saves time
constexpr int PATIENCE = 400;                // number of advances after which p probably only grazes a stop
constexpr double IMPATIENT = 1e-4;           // shortest advance after PATIENCE, as a part of the stretch
constexpr int NEWTON_STEPS = 6;              // largest number of corrections of a touch; usually two

struct ValueAndRate {
  double value, rate;
};

// Evaluates a polynomial of AHEAD terms. Even and odd powers are summed separately, which halves the time.
INLINE ValueAndRate polynomial_at(const double *series, double tau) {
  double square = tau * tau, even = 0.0, odd = 0.0, even_slope = 0.0, odd_slope = 0.0;
  for (int k = AHEAD - 2; k >= 0; k -= 2) {
    even_slope = even_slope * square + even;
    odd_slope = odd_slope * square + odd;
    even = even * square + series[k];
    odd = odd * square + series[k + 1];
  }
  return {even + tau * odd, odd + 2.0 * tau * (even_slope + tau * odd_slope)};
}

// Returns a bound of a derivative of the polynomial on [0, length].
inline double derivative_bound(const double *series, double length, int derivative) {
  double bound = 0.0, power = 1.0;
  for (int k = derivative; k < AHEAD; k++) {
    double factor = 1.0;
    for (int i = 0; i < derivative; i++) factor *= k - i;
    bound += factor * magnitude(series[k]) * power;
    power *= length;
  }
  return bound;
}

// Returns the earliest time [s] at which a gap [m] with the approach speed `approach` [m/s] can close.
INLINE double earliest_closing(double gap, double approach, double bound) {
  if (gap == INFINITE) return INFINITE;
  double root = square_root(approach * approach + 2.0 * bound * gap);
  return approach > 0.0 ? 2.0 * gap / (approach + root) : JUST_SHORT * (root - approach) / bound;
}

// Limits of p on one stretch.
struct Room {
  double lower, upper;  // clearances of the stops [m]; infinite without a stop
  double bound;         // bound of |d2p/dt2| [m/s^2]
  double reach;         // size of the terms of p [m], whose rounding errors limit the detection of a touch

  INLINE double nearer() const { return smaller(lower, upper); }
  INLINE double closed() const { return TOUCH * nearer() + ROUNDING * reach; }
};

// Returns the time of the first touch on [0, length], or NEVER. Leaving a stop at the start is not a touch.
inline double first_contact(const double *series, double length, const Room &room) {
  if (room.nearer() == INFINITE) return NEVER;
  double closed = room.closed(), shortest = smaller(SHORTEST_ADVANCE, IMPATIENT * length);
  double bound = room.bound + 1e-300, tau = 0.0;
  for (int advances = 1; tau < length; advances++) {
    auto [p, rate] = polynomial_at(series, tau);
    double above = room.upper - p, below = room.lower + p;
    if ((above <= closed && rate > 0.0) || (below <= closed && rate < 0.0)) return tau;
    double advance = smaller(earliest_closing(larger(above, 0.0), rate, bound),
                             earliest_closing(larger(below, 0.0), -rate, bound));
    tau += larger(advance, shortest);
    // The first bound ignores that terms of p can cancel; the bound from the polynomial is tighter.
    if (advances == TIGHTER_AFTER) bound = smaller(bound, derivative_bound(series, length, 2) + 1e-300);
    if (advances == PATIENCE) shortest = IMPATIENT * length;
  }
  return NEVER;
}

// Like `first_contact`, for a length of at most LONGEST_TURN. If p provably has no extreme on
// this stretch, p can only touch the stop ahead, and only once, so Newton's method is safe.
inline double first_touch(const double *series, double length, const Room &room) {
  double change = room.bound * LONGEST_TURN;  // largest change of d2p/dt2 on such a stretch
  double side = series[1] > 0.0 ? 1.0 : -1.0;
  double speed = side * series[1], bend = 2.0 * side * series[2], stop = side > 0.0 ? room.upper : room.lower;
  if (!(smaller(speed, speed + bend * length) > change * length)) return first_contact(series, length, room);
  double closed = room.closed(), gap = stop - side * series[0];
  if (gap <= closed) return 0.0;
  if (gap > length * (speed + 0.5 * length * (larger(bend, 0.0) + change))) return NEVER;
  double tau = 2.0 * gap / (speed + square_root(larger(speed * speed + 2.0 * bend * gap, 0.0)));
  for (int n = 0; n < NEWTON_STEPS; n++) {
    tau = smaller(tau, length);
    auto [p, rate] = polynomial_at(series, tau);
    gap = stop - side * p;
    if (tau == length && gap > closed) return NEVER;
    double step = gap / (side * rate);
    tau += step;
    // After this correction, the remaining gap is at most half of bound step^2.
    if (room.bound * step * step <= closed) return smaller(tau, length);
  }
  return first_contact(series, length, room);
}

// Returns the side of the touched stop: the nearer stop, because at a grazing touch the sign of the velocity
// is uncertain by rounding. If p is near the middle, the clearance is almost zero, and the velocity decides.
INLINE double touched_side(double p, double rate, const Specimen &specimen) {
  if (specimen.upper_gap == INFINITE) return -1.0;
  if (specimen.lower_gap == INFINITE) return 1.0;
  double above = specimen.upper_gap - p, below = specimen.lower_gap + p;
  if (magnitude(above - below) <= 0.5 * (specimen.upper_gap + specimen.lower_gap)) return with_sign_of(1.0, rate);
  return above < below ? 1.0 : -1.0;
}

// Time as an exact sum of two doubles, so that neither time nor the drive's phase drifts in a long run.
// Dekker, A floating-point technique for extending the available precision, Numer. Math. 18 (1971).

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

constexpr int RUN_OF_STEPS = 512;  // steps by multiplication between uses of exp; rounding stays below 1e-13
constexpr double LARGEST_BOUND = 1e150;  // above this bound squares overflow, and touches cannot be detected

// Returns the drive's phasor at the clock time plus `later`.
template <class T> INLINE Complex<T> drive_phasor(const Clock<T> &clock, const T &later, const Tables &t) {
  Phasor now = turned_by(angle_at(clock.high, clock.low, value_of(later), t.drive.frequency)) * t.drive.start;
  if constexpr (is_dual<T>) return chained(now, now * Phasor{0.0, t.omega}, later + clock.slip);
  else return now;
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
