// Detection of touches in a flight by a bound of the acceleration of p, without sampling (decision 0004). On
// a stretch of length h, p is a Taylor polynomial (exact to rounding), with |d2p/dt2| <= bound. The stretch
// has no touch if the gaps at both ends exceed bound h^2 / 8. From a gap g with approach speed v, m1 cannot
// reach the stop before 2 g / (v + sqrt(v^2 + 2 bound g)).
#pragma once
#include "tables.hpp"

namespace vibench {

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

}  // namespace vibench
