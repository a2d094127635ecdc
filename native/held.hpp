// m1 at rest on a rigid stop or in contact with a linear stop, impact on a rigid stop, and lift-off. On a
// rigid stop m1 and m2 move as one body; a linear stop gives a stiffer specimen with another rest position.
// Both motions are linear, and exact until the stop would have to pull. Lift-off is the zero of the
// acceleration that presses m1 on the stop, or of the indentation. It is found like the zero of a gap.
#pragma once
#include "flight.hpp"

namespace vibench {

constexpr double RESOLVED = 4.0;       // a hop below this multiple of the largest closed gap counts as rest
constexpr double LARGEST_PART = 1e-3;  // largest gap that counts as closed, relative to the stops' distance
constexpr double SHORTEST_PART = 1e-3;  // shortest departure, as a part of a grid step: the run must advance,
                                        // but m1 must not enter the stop by more than rounding
constexpr double NEARLY = 0.99;         // factor on the shortest time to the other stop: a margin for rounding

// Returns the largest distance at which m1 counts as touching a stop [m]; `reach` is the size of p's terms.
INLINE double closed_gap(double reach, const Specimen &s) {
  return TOUCH * smaller(s.lower_gap, s.upper_gap) + ROUNDING * reach;
}
INLINE double closed_gap(const Phasor *phasors, const Tables &t) {
  double reach = 0.0;
  for (int j = 0; j <= t.flight.modes; j++) reach += magnitude(phasors[j] * t.flight.path[j]);
  return closed_gap(reach, t.specimen);
}
// Returns whether p is exact enough to distinguish m1 between the stops from m1 on a stop.
INLINE bool is_resolved(double closed, const Specimen &s) {
  return closed < LARGEST_PART * (s.lower_gap + s.upper_gap);
}

// Returns the acceleration that presses m1 on the stop at `side`: d2|p|/dt2 without the stop's force [m/s^2].
template <class T> INLINE T press_on(double side, const T *motion, const Body &t) {
  const Specimen &s = t.specimen;
  T pull = s.k2 * (motion[Z] - motion[X]) + s.c2 * (motion[VZ] - motion[VX]);
  T inner = s.k1 * gap_at(s, side) + s.c1 * (side * (motion[VY] - motion[VZ]));
  return side * pull / s.m2 - inner / t.pair;
}

// Places m1 exactly on a stop with d|p|/dt = `rate` [m/s]. Centre of mass and momentum of m1 and m2 are kept.
template <class T> inline void place_on_stop(T *motion, double side, const T &rate, const Body &t) {
  double gap = side * gap_at(t.specimen, side), share = t.pair / t.specimen.m2;
  T before = motion[Y] - motion[Z], relative = motion[VY] - motion[VZ];
  motion[Z] = motion[Z] - share * (gap - before);
  motion[VZ] = motion[VZ] - share * (side * rate - relative);
  motion[Y] = motion[Z] + gap;
  motion[VY] = motion[VZ] + side * rate;
}

// Brings m1 to rest on a stop if the remaining impacts are too small to follow. Returns whether m1 rests.
// Under an acceleration a towards the stop, m1 chatters: each hop is `restitution` times as long as the hop
// before, so infinitely many impacts take 2 v / (a (1 - restitution)). Hops are omitted if they cannot be
// distinguished from rest, or if their speeds sum to less than the tolerance times the speed of a fall.
template <class T>
inline bool hold_if_pressed(T *motion, double side, double closed, double tolerance, const Body &t) {
  double rate = value_of(motion[VY] - motion[VZ]), press = value_of(press_on(side, motion, t));
  double part = tolerance * (1.0 - t.specimen.restitution);
  double too_low = RESOLVED * closed + part * part * gap_at(t.specimen, side);
  if (!(press >= 0.0 && rate * rate <= 2.0 * press * too_low)) return false;
  place_on_stop(motion, side, constant<T>(0.0), t);
  return true;
}

// Impact on a rigid stop: displacements are kept, and the approach speed is multiplied by `restitution`
// (Newton). Returns whether m1 comes to rest. A touch is detected slightly before the gap closes. The speed
// is corrected to its value at closure, so that a million impacts do not accumulate an error.
template <class T> inline bool rebound(T *motion, double side, double closed, double tolerance, const Body &t) {
  T approach = side * (motion[VY] - motion[VZ]);
  double hair = gap_at(t.specimen, side) - side * value_of(motion[Y] - motion[Z]);
  T square = approach * approach + 2.0 * hair * press_on(side, motion, t);
  T speed = value_of(square) > 0.0 ? square_root(square) : constant<T>(0.0);
  place_on_stop(motion, side, -t.specimen.restitution * speed, t);
  return hold_if_pressed(motion, side, closed, tolerance, t);
}

// Finds how long m1 stays on a stop: until lift-off (returned as TOUCHES), or for `longest` seconds. `level`
// is `let_go` times the gap.
inline Flight hold(double side, double level, const Phasor *phasors, const Clock<double> &clock, double longest,
                   const Tables &tables) {
  const LinearTables &t = tables.held;
  double elapsed = 0.0, h = t.grid;
  Phasor now[PHASORS];
  while (elapsed < longest) {
    propagate(now, phasors, elapsed, drive_phasor(clock, elapsed, tables), t);
    PhasorSum<PHASORS> pull(now, tables.pulls, t);
    for (Phasor &term : pull.terms) term = -side * term;
    Room room{INFINITE, 0.0, pull.bound, level + pull.reach};
    if (!(pull.bound < LARGEST_BOUND)) return {FlightEnd::LOST, elapsed};
    int steps = whole_steps(longest - elapsed, h, RUN_OF_STEPS);
    double high = -level - pull.bound * h * h / 8.0;
    if (steps > 0 && pull.now() < high) {
      int made = pull.march(steps, -INFINITE, high);
      elapsed += made * h;
      if (made == steps) continue;
    }
    double length = smaller(h, longest - elapsed), series[AHEAD];
    pull.rows(t.series).store(series);
    series[0] += level;
    double free = first_contact(series, length, room);
    if (free != NEVER) return {FlightEnd::TOUCHES, elapsed + free};
    elapsed = length < h ? longest : elapsed + length;
  }
  return {FlightEnd::CLEAR, longest};
}

// Returns a lower bound of the time during which a flight that starts on a rigid stop moves away from it [s];
// 0 if it does not start on a stop. A search cannot distinguish leaving from touching at first, because the
// gap is zero within rounding. But the gap grows while d2|p|/dt2 <= a + j t + b t^2 / 2 <= 0 and the other
// stop is out of reach. Here a, j are d2|p|/dt2, d3|p|/dt3 at the start, and b bounds the fourth derivative.
inline double time_to_lift_off(const double *series, double length, double closed, const Specimen &s) {
  double side = s.upper_gap - series[0] <= closed ? 1.0 : s.lower_gap + series[0] <= closed ? -1.0 : 0.0;
  double rate = side * series[1], bend = side * 2.0 * series[2], jerk = side * 6.0 * series[3];
  double low = RESOLVED * closed, size = magnitude(rate);
  // A speed counts as zero if acceleration or jerk alone can stop m1 within a few closed gaps.
  bool by_bend = rate * rate <= 2.0 * magnitude(bend) * low;
  bool by_jerk = 8.0 * size * size * size <= 9.0 * magnitude(jerk) * low * low;
  if (side == 0.0 || !(by_bend || by_jerk)) return 0.0;
  // Here m1 is still pressed on the stop: it would enter the stop by more than rounding before it returns.
  if (bend > 0.0 && !(jerk < 0.0 && 2.0 * bend * bend * bend <= 3.0 * closed * jerk * jerk)) return 0.0;
  double bound = derivative_bound(series, length, 4), under_root = jerk * jerk - 2.0 * bend * bound;
  double sure = under_root > 0.0 ? 0.5 * (square_root(under_root) - jerk) / larger(bound, 1e-300) : 0.0;
  double fastest = derivative_bound(series, length, 2);
  double across = NEARLY * square_root(2.0 * (s.lower_gap + s.upper_gap) / larger(fastest, 1e-300));
  return smaller(smaller(length, across), larger(sure, SHORTEST_PART * length));
}

inline double lift_off(const Phasor *phasors, double closed, const Tables &t) {
  double series[AHEAD];
  PhasorSum<PHASORS>(phasors, t.flight.path, t.flight).rows(t.flight.series).store(series);
  return time_to_lift_off(series, t.flight.grid, closed, t.specimen);
}

}  // namespace vibench
