// A run: flight, contact, flight, ... up to a given time. The templates also serve motions with derivatives.
#pragma once
#include "held.hpp"
#include "power_law.hpp"

namespace vibench {

// ---- Types of stops. They select the code of a contact at compile time.

struct WithoutStops {};
// Stops with a contact force. If `whole_collisions` is true, collisions are solved without steps if possible.
template <class Force> struct YieldingStops {
  Force force;
  static constexpr bool whole_collisions = false;
};
struct HertzStops : YieldingStops<HertzForce> {
  static constexpr bool whole_collisions = true;
};
struct SpringStops {};  // linear stops: solved exactly by the modes of the specimen in contact
struct HardStops {};    // rigid stops: Newton's restitution, or m1 at rest on the stop

// Returns the derivatives of the touch time, with value 0. All corrections at switching points (saltation,
// Mueller 1995) follow from them. At a grazing touch no derivative exists, so the rate is limited from below.
template <class T> inline T later_touch(const T *motion) {
  T p = motion[Y] - motion[Z];
  double rate = value_of(motion[VY] - motion[VZ]);
  return slopes_only(-p) / with_sign_of(larger(magnitude(rate), SLOWEST_TOUCH), rate);
}

// Determines from the displacements whether a motion starts on a stop, and sets up its contact state.
template <class T> inline void place_on_its_side(Motion<T> &m, double tolerance, const Body &t) {
  const Specimen &s = t.specimen;
  double p = value_of(m.at[Y] - m.at[Z]), x = value_of(m.at[X]), z = value_of(m.at[Z]);
  double side = with_sign_of(1.0, p);
  m.contact = {};
  m.powers = {};
  if (s.law == POWERS) {
    m.contact.side = 1.0;  // the law acts at every p
    m.powers.sizes[0] = magnitude(p), m.powers.sizes[1] = magnitude(x), m.powers.sizes[2] = magnitude(z);
  } else if (s.law == RIGID) {
    double closed = closed_gap(magnitude(x) + magnitude(value_of(m.at[Y])) + magnitude(z), s);
    if (!(gap_at(s, side) - side * p <= closed)) return;
    T rate = side * (m.at[VY] - m.at[VZ]);
    place_on_stop(m.at, side, rate, t);
    if (hold_if_pressed(m.at, side, closed, tolerance, t)) m.contact.side = side;
  } else if (s.law != NO_STOPS && (p > s.upper_gap || p < -s.lower_gap)) {
    begin_contact(m.contact, m.at, side, tolerance, t);
  }
}

template <class T, class Stops> class Run {
 public:
  Run(Motion<T> &motion, const Tables &tables, const Stops &stops, double tolerance, Record &record)
      : m(motion), t(tables), stops(stops), tolerance(tolerance), record(record), observer{record, tables} {}

  // Advances the motion to the time `until` [s]. Recording and observation do not change it.
  Outcome advance(double until) { return observed(observer, m, t, [&] { return go_on(until); }); }

 private:
  Outcome go_on(double until) {
    for (;;) {
      T longest = time_until(m.clock, until);
      if (!(value_of(longest) > 0.0)) return REACHED_END;
      if (!is_finite(value_of(m.at[X] + m.at[Y] + m.at[Z]))) return NOT_FINITE;
      if (record.steps_left <= 0) return TOO_LONG;
      Outcome outcome = m.contact.side == 0.0 ? fly_on(until, longest) : stay(until, longest);
      if (outcome != REACHED_END) return outcome;
      if constexpr (is_dual<T>)
        if (keep_in_range(m)) is_drive_known = false;  // derivatives of `drive` still contain the factor
    }
  }

  Motion<T> &m;
  const Tables &t;
  const Stops &stops;
  double tolerance;
  Record &record;
  Observer observer;
  Complex<T> drive;             // current phasor of the drive, if known
  bool is_drive_known = false;

  template <class A, class B> static constexpr bool is_same = __is_same(A, B);

  void pass(const T &time) {
    vibench::advance(m.clock, time);
    is_drive_known = false;
  }
  void arrive(double until) {
    m.clock = {until, 0.0, constant<T>(0.0)};
    is_drive_known = false;
  }
  Complex<T> drive_now() const { return is_drive_known ? drive : drive_phasor(m.clock, constant<T>(0.0), t); }
  Clock<double> clock_value() const { return {m.clock.high, m.clock.low, 0.0}; }

  // ---- Flight

  Flight next_flight(const Phasor *phasors, double longest) const {
    if constexpr (is_same<Stops, HardStops>) {
      double closed = closed_gap(phasors, t);
      if (!is_resolved(closed, t.specimen)) return {FlightEnd::LOST, 0.0};
      if (double leaves = lift_off(phasors, closed, t); leaves > 0.0)
        return {FlightEnd::CLEAR, smaller(leaves, longest)};
    }
    return fly(phasors, clock_value(), longest, t);
  }

  Outcome fly_on(double until, const T &longest) {
    Complex<T> phasors[PHASORS], landed[PHASORS];
    Phasor values[PHASORS];
    start_flight(phasors, m.at, drive_now(), t.flight);
    copy_values(values, phasors, t.flight);
    Flight flight = next_flight(values, smaller(value_of(longest), double(record.steps_left) * t.flight.grid));
    if (flight.ends == FlightEnd::LOST) return NOT_FINITE;
    bool is_whole = flight.ends == FlightEnd::CLEAR && flight.length >= value_of(longest);
    T length = is_whole ? longest : constant<T>(flight.length);
    land(landed, phasors, length);
    if constexpr (is_dual<T>)
      if (flight.ends == FlightEnd::TOUCHES) {
        length = length + later_touch(m.at);
        land(landed, phasors, length);
      }
    if (observer.is_on()) observer.see_flight(values, clock_value(), flight.length);
    keep_samples(record, clock_value(), flight.length, [&](double later, double *sample) {
      Phasor there[PHASORS];
      propagate(there, values, later, drive_phasor(clock_value(), later, t), t.flight);
      place(sample, there, t.flight);
    });
    record.steps_left -= steps_of(flight.length, t.flight.grid);
    if (is_whole) {
      arrive(until);
      return REACHED_END;
    }
    pass(length);
    drive = landed[t.flight.modes];
    is_drive_known = true;
    return flight.ends == FlightEnd::TOUCHES ? touch(landed) : REACHED_END;
  }

  void land(Complex<T> *landed, const Complex<T> *phasors, const T &length) {
    propagate(landed, phasors, length, drive_phasor(m.clock, length, t), t.flight);
    place(m.at, landed, t.flight);
  }

  Outcome touch(const Complex<T> *landed) {
    if (!keep_impact(record, m.clock.high)) return TOO_MANY_IMPACTS;
    double p = value_of(m.at[Y] - m.at[Z]), rate = value_of(m.at[VY] - m.at[VZ]);
    double side = touched_side(p, rate, t.specimen);
    if constexpr (is_same<Stops, HardStops>) {
      Phasor values[PHASORS];
      copy_values(values, landed, t.flight);
      m.contact.side = rebound(m.at, side, closed_gap(values, t), tolerance, t) ? side : 0.0;
      observer.see_impact(value_of(m.at[VY] - m.at[VZ]) - rate, values[t.flight.modes]);
    } else {
      // The penetration at a touch is zero; w = 0 removes its rounding error.
      begin_contact(m.contact, m.at, side, tolerance, t);
      m.contact.w = constant<T>(0.0);
    }
    return REACHED_END;
  }

  // ---- On a stop

  Outcome stay(double until, const T &longest) {
    if constexpr (is_same<Stops, SpringStops> || is_same<Stops, HardStops>) return stay_held(until, longest);
    else if constexpr (is_same<Stops, WithoutStops>) return NOT_FINITE;  // there is no stop
    else return stay_pressed(until, longest);
  }

  Outcome stay_held(double until, const T &longest) {
    double side = m.contact.side, gap = gap_at(t.specimen, side), rests = side * t.rests * gap;
    Complex<T> phasors[PHASORS], landed[PHASORS];
    Phasor values[PHASORS];
    m.at[Y] = m.at[Y] - rests;
    start_flight(phasors, m.at, drive_now(), t.held);
    copy_values(values, phasors, t.held);
    double most = smaller(value_of(longest), double(record.steps_left) * t.held.grid);
    Flight held = hold(side, t.let_go * gap, values, clock_value(), most, t);
    if (held.ends == FlightEnd::LOST) return NOT_FINITE;
    bool is_whole = held.ends == FlightEnd::CLEAR && held.length >= value_of(longest);
    T length = is_whole ? longest : constant<T>(held.length);
    propagate(landed, phasors, length, drive_phasor(m.clock, length, t), t.held);
    place(m.at, landed, t.held);
    m.at[Y] = m.at[Y] + rests;
    if (held.ends == FlightEnd::TOUCHES) m.at[Y] = slopes_only(m.at[Y]) + (value_of(m.at[Z]) + side * gap);
    if (observer.is_on()) {
      Phasor ends[PHASORS];
      copy_values(ends, landed, t.held);
      observer.see_held(values, ends, clock_value(), side, held.length);
    }
    keep_samples(record, clock_value(), held.length, [&](double later, double *sample) {
      Phasor there[PHASORS];
      propagate(there, values, later, drive_phasor(clock_value(), later, t), t.held);
      place(sample, there, t.held);
      sample[Y] += rests;
    });
    record.steps_left -= steps_of(held.length, t.held.grid);
    if (held.ends == FlightEnd::TOUCHES) m.contact.side = 0.0;
    if (is_whole) arrive(until);
    else pass(length);
    return REACHED_END;
  }

  Outcome stay_pressed(double until, const T &longest) {
    record.steps_left -= RESOLVED_STEP;
    bool is_sampled = record.samples_kept < record.sample_room;
    Motion<double> before;
    if (is_sampled) before = values_of(m);
    if constexpr (Stops::whole_collisions)
      if (value_of(m.contact.w) == 0.0) {
        Collision<T> collision;
        Complex<T> now = drive_now();
        if (collide(collision, m.at, m.contact.side, m.contact.pace, now, value_of(longest), tolerance, t)) {
          double length = value_of(collision.duration);
          if (observer.is_on())
            observer.see_collision(values_of(collision), m.contact.side, {value_of(now.re), value_of(now.im)});
          m.contact.side = 0.0;
          if (is_sampled) sample_contact(before, length, BaseForce(clock_value(), 0.5 * length, t));
          pass(collision.duration);
          return REACHED_END;
        }
      }
    BaseForce base(clock_value(), smaller(0.5 * value_of(longest), 0.5 * STRETCH_TURN / t.omega), t);
    bool is_last = value_of(longest) <= 2.0 * base.middle;
    // Only the start of this stretch depends on the initial state; clock times have no derivatives.
    T begin = m.clock.slip, tau = begin;
    T limit = constant<T>(is_last ? value_of(longest) : 2.0 * base.middle);
    auto seen = [&](const auto &steps, const T &h) {
      if (observer.is_on()) observer.see_step(steps, value_of(h), m.contact);
    };
    switch (advance_contact(m.contact, m.at, tau, limit, base, stops.force, tolerance, t, seen)) {
      case ContactEnd::LOST: return NOT_FINITE;
      case ContactEnd::STALLED: return STALLED;
      case ContactEnd::HELD:
        if (is_sampled) sample_contact(before, value_of(tau), base);
        if (is_last) arrive(until);
        else pass(tau - begin);
        return REACHED_END;
      case ContactEnd::LEFT: break;
    }
    if (is_sampled) sample_contact(before, value_of(tau), base);
    pass(tau - begin);
    return REACHED_END;
  }

  // ---- Samples

  // Computes the samples of a contact by a second integration from its start, which stops at each sample.
  void sample_contact(Motion<double> &shadow, double length, const BaseForce &base) {
    double reached = 0.0;
    keep_samples(record, clock_value(), length, [&](double later, double *sample) {
      if (shadow.contact.side != 0.0 && later > reached)
        advance_contact(shadow.contact, shadow.at, reached, later, base, stops.force, tolerance, t, [](auto &&...) {});
      __builtin_memcpy(sample, shadow.at, sizeof shadow.at);
    });
  }
};

// Growth of the tangent vectors of a motion, for Lyapunov exponents and Floquet multipliers. Between readings
// they are integrated exactly, as dual numbers. At a reading they are made orthonormal in a metric, and the
// logarithms of the removed factors are stored (Benettin et al., Meccanica 15 (1980) 9 and 21).

// ---- Conversion between rows of tangent vectors and dual numbers

// The derivatives of w and r in a contact follow from displacements and velocities, with |p| = gap + w^2.
template <int M> inline Motion<Dual<double, M>> with_changes(const Motion<double> &plain, const Tangent &tangent) {
  Motion<Dual<double, M>> motion{};
  for (int i = 0; i < 6; i++) motion.at[i].value = plain.at[i];
  motion.clock.high = plain.clock.high, motion.clock.low = plain.clock.low;
  const Contact<double> &c = plain.contact;
  auto &contact = motion.contact;
  contact.side = c.side, contact.step = c.step;
  contact.root_scale = c.root_scale, contact.rate_scale = c.rate_scale, contact.pace = c.pace;
  contact.w.value = c.w, contact.r.value = c.r;
  motion.powers = plain.powers;
  for (int k = 0; k < M && k < int(tangent.changes); k++) {
    const double(&row)[6] = tangent.rows[k];
    for (int i = 0; i < 6; i++) motion.at[i].slope[k] = row[i];
    motion.growth[k] = tangent.growth[k];
    contact.w.slope[k] = c.w > 0.0 ? 0.5 * c.side * (row[Y] - row[Z]) / c.w : 0.0;
    contact.r.slope[k] = c.side * (row[VY] - row[VZ]);
  }
  return motion;
}

inline void keep_changes(Tangent &, const Motion<double> &) {}
template <int M> inline void keep_changes(Tangent &tangent, const Motion<Dual<double, M>> &motion) {
  for (int k = 0; k < M && k < int(tangent.changes); k++) {
    for (int i = 0; i < 6; i++) tangent.rows[k][i] = motion.at[i].slope[k];
    tangent.growth[k] = motion.growth[k];
  }
}

// ---- QR step for the exponents: modified Gram-Schmidt. Two passes suffice (Giraud, Langou and Rozloznik,
// Comput. Math. Appl. 50 (2005) 1069).

constexpr int ORTHOGONAL_PASSES = 2;
constexpr double DIRECTION_LOST = 1e-11;  // a row with at most this part of its length left has no direction

using Metric = double[6][6];

inline double inner(const double (&a)[6], const double (&b)[6], const Metric &metric) {
  double sum = 0.0;
  for (int i = 0; i < 6; i++) {
    double part = 0.0;
    for (int j = 0; j < 6; j++) part += metric[i][j] * b[j];
    sum += a[i] * part;
  }
  return sum;
}

// Removes from row `i` its components along the earlier rows; returns the remaining length.
inline double left_of(double (&rows)[6][6], int i, const Metric &metric) {
  for (int pass = 0; pass < ORTHOGONAL_PASSES; pass++)
    for (int j = 0; j < i; j++) {
      double along = inner(rows[j], rows[i], metric);
      for (int k = 0; k < 6; k++) rows[i][k] -= along * rows[j][k];
    }
  return square_root(inner(rows[i], rows[i], metric));
}

// Makes rows orthonormal, and adds the logarithms of their divisors to `logarithms`. A row that depends
// linearly on earlier rows (two after an impact without rebound) gets minus infinity, and is set to an axis.
inline void orthonormalise(double (&rows)[6][6], int count, const Metric &metric, double *logarithms) {
  for (int i = 0; i < count; i++) {
    double whole = square_root(inner(rows[i], rows[i], metric)), length = left_of(rows, i, metric);
    if (!(length > DIRECTION_LOST * whole) && is_finite(whole)) {
      logarithms[i] = -INFINITE;
      for (int axis = 0; axis < 6; axis++) {
        for (int k = 0; k < 6; k++) rows[i][k] = k == axis ? 1.0 / square_root(metric[axis][axis]) : 0.0;
        length = left_of(rows, i, metric);
        if (length * length * 6.0 > 0.5) break;  // true for at least one axis
      }
    } else {
      logarithms[i] += logarithm(length);
    }
    for (double &number : rows[i]) number /= length;
  }
}

// ---- Readings

// Takes all remaining readings up to `last`; `advance(until)` advances the motion and its tangent vectors.
template <class Advance>
inline Outcome take_readings(const State &state, const Record &record, Tangent &tangent, Readings &readings,
                             int64_t last, const Advance &advance) {
  int changes = int(tangent.changes);
  for (; readings.made < last; readings.made++) {
    int64_t k = readings.made, before = record.impacts;
    double *growth = readings.growth + k * changes;
    for (int i = 0; i < changes; i++) growth[i] = 0.0;
    for (int64_t part = 0; part < readings.parts; part++) {
      Outcome outcome = advance((double(k) + double(part + 1) / double(readings.parts)) * readings.interval);
      if (outcome != REACHED_END) return outcome;
      for (int i = 0; i < changes; i++) growth[i] += tangent.growth[i], tangent.growth[i] = 0.0;
      orthonormalise(tangent.rows, changes, readings.metric, growth);
    }
    readings.impacts[k] = record.impacts - before;
    __builtin_memcpy(readings.motions + 6 * k, state.motion, sizeof state.motion);
  }
  return REACHED_END;
}

}  // namespace vibench
