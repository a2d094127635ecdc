// Motion on a base whose displacement is a cubic on each of equal intervals: a sweep, recording or shaker
// table (decision 0004). Intervals are divided into pieces short enough for a Taylor series. A flight over a
// piece is one matrix product if a bound of its acceleration excludes a touch; else its series is searched.
#pragma once
#include "run.hpp"

namespace vibench {

constexpr int CUBIC = 4;  // number of terms of a cubic
constexpr int MOST_PHASES = 100000;  // largest number of flights and contacts in a piece; chatter has fewer
constexpr double ALMOST = 1.0 - 1e-12;  // tolerance for the rounding error of an interval's length
constexpr int64_t WHOLE_PIECE = int64_t(1) << (LEVELS - 1);  // length of a piece in steps of the last level
constexpr int PIECE_ORDER = 16;  // number of series terms over a piece under a power law
constexpr double TRY_TWICE = 5e-4;  // a misfit below this part of the allowed misfit doubles the next step

// ---- The base

// Base force k0 U + c0 dU/dt = sum terms_k t^k [N].
template <class T> struct CubicForce {
  T terms[CUBIC];
};

// Returns the base force for the terms `base` of U [m, m/s, ...].
INLINE CubicForce<double> base_force(const double *base, const Specimen &s) {
  return {{s.k0 * base[0] + s.c0 * base[1], s.k0 * base[1] + 2.0 * s.c0 * base[2],
           s.k0 * base[2] + 3.0 * s.c0 * base[3], s.k0 * base[3]}};
}

// Returns a base force as a polynomial in t - `by`.
template <class T> INLINE CubicForce<T> shifted(const CubicForce<double> &force, const T &by) {
  const double (&f)[CUBIC] = force.terms;
  return {{f[0] + by * (f[1] + by * (f[2] + by * f[3])), f[1] + by * (2.0 * f[2] + 3.0 * f[3] * by),
           f[2] + 3.0 * f[3] * by, constant<T>(f[3])}};
}

// ---- Taylor series of a motion

// Computes rates of (x, y, z, vx, vy, vz) by Gong et al. 2025, eq. 1, without F; `push` is the force on m0.
template <class T> INLINE void flight_rates(const T *at, const T &push, T *rates, const Body &t) {
  const Specimen &s = t.specimen;
  T pull = s.k2 * (at[Z] - at[X]) + s.c2 * (at[VZ] - at[VX]);
  T hold = s.k1 * (at[Y] - at[Z]) + s.c1 * (at[VY] - at[VZ]);
  rates[X] = at[VX], rates[Y] = at[VY], rates[Z] = at[VZ];
  rates[VX] = t.inverse0 * (pull + push - s.k0 * at[X] - s.c0 * at[VX]);
  rates[VY] = -t.inverse1 * hold;
  rates[VZ] = t.inverse2 * (hold - pull);
}

// Computes the rates like `flight_rates`, but while m1 rests on a rigid stop and forms one body with m2.
template <class T> INLINE void held_rates(const T *at, const T &push, T *rates, const Body &t) {
  const Specimen &s = t.specimen;
  T pull = s.k2 * (at[Z] - at[X]) + s.c2 * (at[VZ] - at[VX]);
  rates[X] = at[VX], rates[Y] = rates[Z] = at[VZ];
  rates[VX] = t.inverse0 * (pull + push - s.k0 * at[X] - s.c0 * at[VX]);
  rates[VY] = rates[VZ] = -pull / (s.m1 + s.m2);
}

template <class T> struct Course {
  T terms[AHEAD][6];

  template <class Rates> Course(const T *motion, const CubicForce<T> &force, const Rates &rates) {
    for (int i = 0; i < 6; i++) terms[0][i] = motion[i];
    for (int k = 0; k + 1 < AHEAD; k++) {
      rates(terms[k], k < CUBIC ? force.terms[k] : constant<T>(0.0), terms[k + 1]);
      for (int i = 0; i < 6; i++) terms[k + 1][i] = (1.0 / (k + 1)) * terms[k + 1][i];
    }
  }
  void place(T *motion, const T &tau) const {
    for (int i = 0; i < 6; i++) {
      T value = terms[AHEAD - 1][i];
      for (int k = AHEAD - 2; k >= 0; k--) value = value * tau + terms[k][i];
      motion[i] = value;
    }
  }
};

// ---- Data of a run

// Effect of each term of the base force on a step under a power law.
struct BaseNumbers {
  double places[CUBIC][GAUSS];  // effect on p at the Gauss points
  double ends[CUBIC][WIDE];     // effect on the motion at the end
};

struct CubicPowerTables : PowerTables {
  BaseNumbers base[LEVELS];
};

struct CubicTables : Body {
  double interval;  // length of an interval [s]
  double fastest;   // fastest rate of the specimen [1/s]
  int64_t pieces;   // number of pieces of an interval
  double length;    // length of a piece [s]
  double across[6 + CUBIC][WIDE];  // motion at a piece's end per motion and force terms at its start
  double bound_per_root_energy;    // largest |d2p/dt2| in flight / sqrt(2 energy) [m/s^2 / J^0.5]
  const CubicPowerTables *power;   // tables for a power law, stored after these tables; otherwise null
};

// Returns the largest |d2p/dt2| in flight / sqrt(2 energy). In the coordinates sqrt(k) e and sqrt(m) v,
// with elongations e of the springs, it is the norm of the coefficients of d2p/dt2.
inline double bound_per_root_energy(const Body &t) {
  const Specimen &s = t.specimen;
  const double parts[] = {s.k1 * t.inverse_pair * t.inverse_pair,
                          s.k2 * t.inverse2 * t.inverse2,
                          s.c2 * s.c2 * t.inverse2 * t.inverse2 * t.inverse0,
                          s.c1 * s.c1 * t.inverse_pair * t.inverse_pair * t.inverse1,
                          (s.c1 * t.inverse_pair + s.c2 * t.inverse2) * (s.c1 * t.inverse_pair + s.c2 * t.inverse2) *
                              t.inverse2};
  double sum = 0.0;
  for (double part : parts) sum += part;
  return square_root(sum);
}

// Fills `base` from the Taylor series of the motion: a force f_k t^k changes the motion by the sum over m of
// f_k (A^m / m!) c t^(m+k+1) m! k! / (m+k+1)!, where c is the effect of a unit force on the rates.
inline void fill_base(BaseNumbers &base, double length, const PowerTables &t, const Body &body) {
  base = {};
  double turn = t.fastest * length;
  for (int k = 0; k < CUBIC; k++) {
    double factor = body.inverse0 * length / (k + 1);
    for (int i = 0; i < k; i++) factor *= length;
    for (int m = 0; m < PIECE_ORDER; m++) {
      add_row(base.ends[k], factor, t.powers[m][X_RATE]);
      for (int i = 0; i < GAUSS; i++) {
        double height = t.heights[m][i] * t.shapes->points[i];
        for (int j = 0; j < k; j++) height *= t.shapes->points[i];
        base.places[k][i] += factor * t.powers[m][X_RATE][P] * height;
      }
      factor *= turn * (m + 1) / (m + k + 2);
    }
  }
}

inline void fill_cubic_tables(CubicTables &t, CubicPowerTables *power, const CubicScene &scene) {
  fill_body(t, scene.specimen);
  t.interval = scene.interval, t.fastest = scene.fastest;
  t.pieces = 1 + int64_t(scene.interval * scene.fastest / LONGEST_TURN);
  t.length = scene.interval / double(t.pieces);
  t.bound_per_root_energy = bound_per_root_energy(t);
  auto rates = [&](const double *at, double push, double *out) { flight_rates(at, push, out, t); };
  for (int j = 0; j < 6 + CUBIC; j++) {
    double motion[6] = {};
    CubicForce<double> force{};
    (j < 6 ? motion[j] : force.terms[j - 6]) = 1.0;
    Course<double>(motion, force, rates).place(motion, t.length);
    for (int i = 0; i < WIDE; i++) t.across[j][i] = i < 6 ? motion[i] : 0.0;
  }
  t.power = power;
  if (power == nullptr) return;
  fill_power_steps(*power, scene.power_shapes, scene.power, t.specimen, Drive{}, LONGEST_TURN / t.length, t.length, 0.5);
  for (int level = 0; level < LEVELS; level++) fill_base(power->base[level], power->levels[level].length, *power, t);
}

// ---- A run

struct PowerStops {};  // a power law acts at every p

template <class T, class Stops> class CubicRun {
 public:
  CubicRun(Motion<T> &motion, const CubicTables &tables, const Stops &stops, double tolerance, Record &record)
      : m(motion), t(tables), stops(stops), tolerance(tolerance), record(record) {}

  // Advances from `begin` to `end` [s] after the start of an interval; `base` contains the terms of U.
  INLINE Outcome advance(const double *base, double begin, double end) {
    bool is_whole = begin == 0.0 && end >= t.interval * ALMOST;
    int64_t pieces = is_whole ? t.pieces : -int64_t(whole_part((begin - end) / t.length));
    double length = is_whole ? t.length : (end - begin) / double(pieces);
    CubicForce<double> force = base_force(base, t.specimen);
    for (int64_t n = 0; n < pieces; n++) {
      Outcome outcome = pass(n == 0 && is_whole ? force : shifted(force, begin + double(n) * length), length, is_whole);
      if (outcome != REACHED_END) return outcome;
    }
    return REACHED_END;
  }

  // Advances through all touches and contacts, from `tau` to `length` [s] after the start of a piece.
  Outcome resolve(const CubicForce<double> &force, double length, bool is_whole, T &tau) {
    if constexpr (is_same<Stops, PowerStops>) return push_on(force, length, is_whole, tau);
    else return move_on(force, length, tau);
  }

 private:
  Motion<T> &m;
  const CubicTables &t;
  const Stops &stops;
  double tolerance;
  Record &record;

  template <class A, class B> static constexpr bool is_same = __is_same(A, B);

  Outcome move_on(const CubicForce<double> &force, double length, T &tau) {
    for (int n = 0; n < MOST_PHASES; n++) {
      if (!(value_of(tau) < length)) return REACHED_END;
      if (record.steps_left-- <= 0) return TOO_LONG;
      Outcome outcome = m.contact.side == 0.0 ? fly(force, length, tau) : stay(force, length, tau);
      if (outcome != REACHED_END) return outcome;
    }
    return STALLED;
  }

  INLINE Outcome pass(const CubicForce<double> &force, double length, bool is_whole) {
    if (record.steps_left-- <= 0) return TOO_LONG;
    if (record.samples_kept < record.sample_room) keep_samples_of(force, length);
    T tau = constant<T>(0.0);
    Outcome outcome = is_whole && cross(force) ? REACHED_END : resolve(force, length, is_whole, tau);
    vibench::advance(m.clock, outcome == REACHED_END ? constant<T>(length) : tau);
    return outcome;
  }

  // Computes each sample as the end of a shorter piece, with a copy of the motion.
  void keep_samples_of(const CubicForce<double> &force, double length) {
    keep_samples(record, {m.clock.high, m.clock.low, 0.0}, length, [&](double later, double *sample) {
      Motion<double> copy = values_of(m);
      Record unseen{};
      unseen.impact_room = record.impact_room, unseen.steps_left = record.steps_left;
      double tau = 0.0;
      if (later > 0.0) CubicRun<double, Stops>(copy, t, stops, tolerance, unseen).resolve(force, later, false, tau);
      __builtin_memcpy(sample, copy.at, sizeof copy.at);
    });
  }

  // Returns a bound of |d2p/dt2| over one piece in flight, from the energy E at its start. Under a base force
  // f, d/dt sqrt(2E) <= |f| / sqrt(m0), and damping only reduces E.
  template <class F> INLINE double acceleration_bound(const CubicForce<F> &force) const {
    const Specimen &s = t.specimen;
    double x = value_of(m.at[X]), y = value_of(m.at[Y]), z = value_of(m.at[Z]), h = t.length;
    double vx = value_of(m.at[VX]), vy = value_of(m.at[VY]), vz = value_of(m.at[VZ]), push = 0.0;
    double kinetic = s.m0 * vx * vx + s.m1 * vy * vy + s.m2 * vz * vz;
    double elastic = s.k0 * x * x + s.k2 * (z - x) * (z - x) + s.k1 * (y - z) * (y - z);
    for (int k = CUBIC - 1; k >= 0; k--) push = push * h + magnitude(value_of(force.terms[k]));
    return t.bound_per_root_energy * (square_root(kinetic + elastic) + h * push * square_root(t.inverse0));
  }

  // Advances a flight over a whole piece. If a touch cannot be excluded, returns false and changes nothing.
  INLINE bool cross(const CubicForce<double> &force) {
    if (m.contact.side != 0.0) return false;
    double margin = acceleration_bound(force) * t.length * t.length / 8.0;
    double low = margin - t.specimen.lower_gap, high = t.specimen.upper_gap - margin;
    double p = value_of(m.at[Y] - m.at[Z]);
    if (!(low < p && p < high)) return false;
    Wide<T, WIDE> even = m.at[0] * Vector<WIDE>::load(t.across[0]), odd = m.at[1] * Vector<WIDE>::load(t.across[1]);
    for (int j = 2; j < 6; j += 2) {
      even = even + m.at[j] * Vector<WIDE>::load(t.across[j]);
      odd = odd + m.at[j + 1] * Vector<WIDE>::load(t.across[j + 1]);
    }
    for (int k = 0; k < CUBIC; k += 2) {
      even = even + force.terms[k] * Vector<WIDE>::load(t.across[6 + k]);
      odd = odd + force.terms[k + 1] * Vector<WIDE>::load(t.across[7 + k]);
    }
    Wide<T, WIDE> after = even + odd;
    p = value_of(at(after, Y) - at(after, Z));
    if (!(low < p && p < high)) return false;
    for (int i = 0; i < 6; i++) m.at[i] = at(after, i);
    return true;
  }

  Outcome fly(const CubicForce<double> &force, double length, T &tau) {
    const Specimen &s = t.specimen;
    CubicForce<T> rest = shifted(force, tau);
    double bound = acceleration_bound(rest), left = length - value_of(tau), path[AHEAD];
    if (!(bound < LARGEST_BOUND)) return NOT_FINITE;
    Course<T> course(m.at, rest, [&](const T *at, const T &push, T *rates) { flight_rates(at, push, rates, t); });
    for (int k = 0; k < AHEAD; k++) path[k] = value_of(course.terms[k][Y] - course.terms[k][Z]);
    Room room{s.lower_gap, s.upper_gap, bound, magnitude(value_of(m.at[Y])) + magnitude(value_of(m.at[Z]))};
    double closed = 0.0;
    if constexpr (is_same<Stops, HardStops>) {
      closed = closed_gap(room.reach, s);
      if (!is_resolved(closed, s)) return NOT_FINITE;
      double leaves = time_to_lift_off(path, left, closed, s);
      if (leaves > 0.0 && leaves < left) {
        course.place(m.at, constant<T>(leaves));
        tau = tau + leaves;
        return REACHED_END;
      }
      if (leaves > 0.0) room.lower = room.upper = INFINITE;
    }
    double touch = first_contact(path, left, room);
    T later = touch == NEVER ? length - tau : constant<T>(touch);
    course.place(m.at, later);
    if (touch == NEVER) {
      tau = constant<T>(length);
      return REACHED_END;
    }
    if constexpr (is_dual<T>) {
      later = later + later_touch(m.at);
      course.place(m.at, later);
    }
    tau = tau + later;
    return touch_stop(value_of(tau), closed);
  }

  Outcome touch_stop(double tau, double closed) {
    if (!keep_impact(record, m.clock.high + tau)) return TOO_MANY_IMPACTS;
    double side = touched_side(value_of(m.at[Y] - m.at[Z]), value_of(m.at[VY] - m.at[VZ]), t.specimen);
    if constexpr (is_same<Stops, HardStops>) {
      m.contact.side = rebound(m.at, side, closed, tolerance, t) ? side : 0.0;
    } else {
      begin_contact(m.contact, m.at, side, tolerance, t);
      m.contact.w = constant<T>(0.0);
    }
    return REACHED_END;
  }

  Outcome stay(const CubicForce<double> &force, double length, T &tau) {
    if constexpr (is_same<Stops, HardStops>) return stay_held(force, length, tau);
    else if constexpr (is_same<Stops, WithoutStops>) return NOT_FINITE;  // there is no stop
    else {
      record.steps_left -= RESOLVED_STEP;
      auto seen = [](auto &&...) {};
      switch (advance_contact(m.contact, m.at, tau, constant<T>(length), BaseForce(force.terms), stops.force, tolerance,
                              t, seen)) {
        case ContactEnd::LOST: return NOT_FINITE;
        case ContactEnd::STALLED: return STALLED;
        default: return REACHED_END;
      }
    }
  }

  // Advances m1 on a rigid stop, until the acceleration that presses m1 on the stop becomes zero.
  Outcome stay_held(const CubicForce<double> &force, double length, T &tau) {
    const Specimen &s = t.specimen;
    double side = m.contact.side, gap = gap_at(s, side), left = length - value_of(tau), path[AHEAD];
    Course<T> course(m.at, shifted(force, tau),
                     [&](const T *at, const T &push, T *rates) { held_rates(at, push, rates, t); });
    for (int k = 0; k < AHEAD; k++) {
      const T *at = course.terms[k];
      path[k] = -side * t.inverse2 * value_of(s.k2 * (at[Z] - at[X]) + s.c2 * (at[VZ] - at[VX]));
    }
    double spring = s.k1 * gap * t.inverse_pair, reach = spring + magnitude(path[0]) + magnitude(path[1]) * left;
    path[0] += spring;
    if (!is_finite(reach)) return NOT_FINITE;
    double free = first_contact(path, left, Room{INFINITE, 0.0, derivative_bound(path, left, 2), reach});
    T later = free == NEVER ? length - tau : constant<T>(free);
    course.place(m.at, later);
    m.at[Y] = m.at[Z] + side * gap;
    if (free != NEVER) m.contact.side = 0.0;
    tau = free == NEVER ? constant<T>(length) : tau + later;
    return REACHED_END;
  }

  // Advances under a power law: a piece is one step, or is halved repeatedly until each step is accurate.
  Outcome push_on(const CubicForce<double> &force, double length, bool is_whole, T &tau) {
    const CubicPowerTables &of = *t.power;
    PowerStep<T> step{t, of, fit_tolerance(tolerance, t.specimen), {}, {}, {}, {}, {}, {}, 0.0, 0.0, 0.0};
    step.begin_at(m);
    int level = int(m.powers.level);
    StepNumbers part;
    BaseNumbers base_of_part;
    Outcome outcome = REACHED_END;
    for (int64_t left = WHOLE_PIECE; left > 0; record.steps_left -= RESOLVED_STEP) {
      if (record.steps_left <= 0) {
        outcome = TOO_LONG;
        break;
      }
      level = step.level_that_sees(level);
      while (level < LEVELS && (WHOLE_PIECE >> level) > left) level++;
      if (level >= LEVELS) {
        outcome = is_finite(total(value_of(step.motion))) ? STALLED : NOT_FINITE;
        break;
      }
      if (!is_whole) {
        fill_step(part, length / double(int64_t(1) << level), of, PIECE_ORDER);
        fill_base(base_of_part, part.length, of, t);
      }
      const StepNumbers &numbers = is_whole ? of.levels[level] : part;
      const BaseNumbers &base = is_whole ? of.base[level] : base_of_part;
      auto free = step.unforced(numbers);
      double done = length * (1.0 - double(left) / double(WHOLE_PIECE));
      CubicForce<double> rest = shifted(force, done);
      for (int k = 0; k < CUBIC; k++) {
        free.places = free.places + rest.terms[k] * Vector<GAUSS>::load(base.places[k]);
        free.end = free.end + rest.terms[k] * Vector<WIDE>::load(base.ends[k]);
      }
      double misfit = step.attempt(numbers, free);
      if (!(misfit <= 1.0)) {
        level++;
        continue;
      }
      step.differentiate(numbers);
      step.fading = 1.0 - (1.0 - FADING) / LONGEST_POWER_TURN * t.fastest * numbers.length;
      step.accept(numbers);
      left -= WHOLE_PIECE >> level;
      if (misfit < TRY_TWICE && level > 0) level--;
    }
    step.write_to(m);
    for (int i = 0; i < 3; i++) m.powers.sizes[i] = step.sizes[i];
    m.powers.level = level < LEVELS ? level : LEVELS - 1;
    tau = constant<T>(length);
    return outcome;
  }
};

// Advances over the remaining intervals of a drive.
template <class Run> inline Outcome follow(Run &run, const Motion<double> &motion, CubicDrive &drive, double interval,
                                           const Record &record) {
  int64_t intervals = drive.base.size / CUBIC;
  for (; drive.done < intervals; drive.done++) {
    int64_t n = drive.done, before = record.impacts;
    Outcome outcome = run.advance(drive.base.at + CUBIC * n, n == 0 ? drive.first_from : 0.0,
                                  n + 1 == intervals ? drive.last_to : interval);
    if (outcome != REACHED_END) return outcome;
    if (drive.motions.size == 0) continue;
    __builtin_memcpy(drive.motions.at + 6 * n, motion.at, sizeof motion.at);
    drive.impacts.at[n] = double(record.impacts - before);
  }
  return REACHED_END;
}

// Builds the `CubicRun` for the specimen's law, and returns the result of `act` with it.
template <class T, class Act>
inline Outcome with_cubic_stops(Motion<T> &motion, const CubicTables &t, double tolerance, Record &record,
                                const Act &act) {
  auto with = [&](const auto &stops) {
    CubicRun run(motion, t, stops, tolerance, record);
    return act(run);
  };
  const Specimen &s = t.specimen;
  switch (s.law) {
    case NO_STOPS: return with(WithoutStops{});
    case HERTZ: return with(HertzStops{{HertzForce{s.contact_stiffness}}});
    case YIELDING:
    case SPRINGS:
      return with(YieldingStops<YieldingForce>{{s.linear_stiffness, s.contact_stiffness, s.loss}});
    case RIGID: return with(HardStops{});
    case POWERS: return with(PowerStops{});
    default: return REFUSED;
  }
}

}  // namespace vibench
