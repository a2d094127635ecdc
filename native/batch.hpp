// Eight motions of one specimen in parallel, one per lane of a vector register (decision 0061). In flight, p
// is the real part of a sum of four rotating phasors ("terms"). Lanes advance by grid steps, as in
// flight.hpp, until at most one lane is clear of the stops. Then the touch, the collision (by polynomials)
// and the first step after it are computed for the other lanes, under masks. A lane with a finished motion
// takes the next motion of the batch. Other lanes can delay a motion, but never change its results.
//
// Observed motions: lines need only the moments of each collision's force. New peaks are rare, and bounds
// exclude almost all steps and collisions. The others are observed one by one, as in observe.hpp.
//
// Tangent vectors: the derivatives of the terms fly like the terms. Touches and collisions are computed with
// dual numbers, so a tangent vector is the exact derivative of the batch's motion.
#pragma once
#include "run.hpp"

namespace vibench {

constexpr int LANES = 8;
constexpr unsigned ALL_LANES = (1u << LANES) - 1;
constexpr int DRIVEN = 3, FLYING = 4;     // index of the drive's term, after three modes; number of terms
constexpr int ORDERS = 12;                // number of series terms over a grid step; the next is 0.25^12 / 12!
constexpr double FOUR = 4.0;              // number of grid steps taken together far from the stops
constexpr int SHORT = 6, LONG = 10;       // number of sine and cosine terms for angles up to 0.25 and 1 [rad]
constexpr int WAITING = 1;                // a march ends when at most this many lanes are clear of the stops
constexpr int TOUCH_CORRECTIONS = 3;      // number of Newton steps to a touch from a second-order guess
constexpr int ROOT_CORRECTIONS = 3;       // corrections of the fifth root from a guess with a few % error
constexpr int HIGHEST = 8;                // order of the highest derivative of p that is used at a touch
constexpr double LONGEST_PART = 0.25;     // longest collision / drive period, so that LONG terms suffice
// Bound of the largest depth of a collision, in its units: a quadratic function of the acceleration at its
// middle, plus a part proportional to the derivative of this acceleration. It is at most 0.7 % too large.
constexpr double DEEPEST[3] = {1.005, 0.796, 0.16}, DEEPER_BY_CHANGE = -0.728;
constexpr double SPARE = 2.0;             // factor on a bound of x, because a stop's force bends x a little
constexpr double LARGEST_CHANGE = 1e60;   // square of a tangent vector above which it is rescaled
constexpr int64_t MOST_EVENTS = 10000;    // limit of the mean number of events per drive period
static_assert(HIGHEST < ORDERS && ORDERS <= AHEAD);

using Lanes = Vector<LANES>;
using LaneDual = Dual<Lanes, 1>;
using LanePhasor = Complex<Lanes>;

struct InverseFactorials {
  double of[2 * LONG];
  constexpr InverseFactorials() : of{} {
    double factorial = 1.0;  // exact: the odd part of 19! fits into 53 bits
    for (int k = 0; k < 2 * LONG; k++) of[k] = 1.0 / factorial, factorial *= k + 1;
  }
};
constexpr InverseFactorials INVERSE_FACTORIALS;

// Returns a b + c if a, b or c is a dual number; the values are those of plain numbers.
template <class A, class B, class C>
  requires(is_dual<A> || is_dual<B> || is_dual<C>)
INLINE LaneDual fused(const A &a, const B &b, const C &c) {
  Lanes slope = 0.0;
  if constexpr (is_dual<C>) slope = c.slope[0];
  if constexpr (is_dual<B>) slope = fused(value_of(a), b.slope[0], slope);
  if constexpr (is_dual<A>) slope = fused(a.slope[0], value_of(b), slope);
  return {fused(value_of(a), value_of(b), value_of(c)), {slope}};
}

template <class A, class B> INLINE auto fused_product(const Complex<A> &x, const Complex<B> &y) {
  auto re = fused(x.re, y.re, -(x.im * y.im));
  return Complex<decltype(re)>{re, fused(x.re, y.im, x.im * y.re)};
}
// Returns sum + Re(x y).
template <class T> INLINE T with_real_of_product(const T &sum, const Complex<T> &x, const LanePhasor &y) {
  return fused(-x.im, y.im, fused(x.re, y.re, sum));
}
INLINE LanePhasor select(Mask mask, const LanePhasor &a, const LanePhasor &b) {
  return {select(mask, a.re, b.re), select(mask, a.im, b.im)};
}

// Returns exp(i angle), by N terms of the series of cosine and of sine.
template <int N> INLINE LanePhasor turned_by_series(Lanes angle) {
  Lanes square = angle * angle, cosine = 0.0, sine = 0.0;
  for (int k = N - 1; k >= 0; k--) {
    double sign = k % 2 ? -1.0 : 1.0;
    cosine = fused(cosine, square, sign * INVERSE_FACTORIALS.of[2 * k]);
    sine = fused(sine, square, sign * INVERSE_FACTORIALS.of[2 * k + 1]);
  }
  return {cosine, sine * angle};
}

INLINE Lanes larger(Lanes a, Lanes b) { return select(a < b, b, a); }

// Returns exp(rate time), for a mode that decays little during `time`.
template <int N> INLINE LanePhasor grown_by_series(const LanePhasor &rate, Lanes time) {
  Lanes shrinks = rate.re * time, size = INVERSE_FACTORIALS.of[6];
  for (int k = 5; k >= 0; k--) size = fused(size, shrinks, INVERSE_FACTORIALS.of[k]);
  LanePhasor turned = turned_by_series<N>(rate.im * time);
  return {size * turned.re, size * turned.im};
}

template <int N> INLINE Complex<LaneDual> grown_by_series(const LanePhasor &rate, const LaneDual &time) {
  LanePhasor now = grown_by_series<N>(rate, time.value);
  return chained(now, fused_product(now, rate), time);
}

// Calls `act` with the index of each lane whose bit is set.
template <class Act> INLINE void for_each_lane(unsigned lanes, const Act &act) {
  for (; lanes != 0; lanes &= lanes - 1) act(__builtin_ctz(lanes));
}

class BatchRun {
 public:
  explicit BatchRun(const Batch &batch)
      : batch(batch), fit(*batch.fit), tables(*batch.motions->tables), lower(tables.specimen.lower_gap),
        upper(tables.specimen.upper_gap) {}

  void follow();

 private:
  // States that are due, once per drive period. Stored as terms until eight states are computed together.
  struct DueStates {
    LanePhasor term[FLYING], change[FLYING];
    Lanes later;  // due time minus time of the terms, zero or negative [s]
    double lost[LANES];
  };

  const Batch &batch;
  const CollisionFit &fit;
  const Tables &tables;  // tables of the first motion; all motions have the same specimen
  double lower, upper;   // clearances [m]

  // Constants of the motion in each lane.
  BatchMotion *motion[LANES] = {};
  LanePhasor rate[FLYING] = {};              // complex rate of each term [1/s]
  LanePhasor one_step[FLYING] = {}, four_steps[FLYING] = {};  // factors of a term over one and four grid steps
  LanePhasor series[ORDERS][FLYING] = {};    // Taylor coefficients of exp(rate t)
  Lanes square[FLYING] = {}, cube[FLYING] = {};  // square and cube of |rate|
  LanePhasor kick[DRIVEN] = {};              // change of a term by the impulse `pair` times 1 m/s
  LanePhasor drive = {};                     // term of the drive at the start of each drive period
  Lanes period = {}, frequency = {}, grid = {};
  Phasor shapes[LANES][FLYING][6] = {};      // motion for a term of 1 m
  LanePhasor across[FLYING] = {};            // x for a term of 1 m
  Lanes across_square[FLYING] = {};          // its magnitude times |rate|^2

  // Current state of each lane.
  LanePhasor term[FLYING] = {};              // terms of p, which is the real part of their sum [m]
  Lanes left = {};                           // time until the next state is due, once per drive period [s]
  Lanes reach = {}, bound = {}, jerk = {};   // bounds of |p|, |d2p/dt2| and |d3p/dt3| until the next touch
  Lanes low = {}, high = {};                 // a step has no touch if p is within these limits at both ends
  Lanes low_four = {}, high_four = {};       // the same limits for four steps
  Lanes touch = {};                          // time until the next touch [s]
  // Tangent vector of each lane in `carried`: derivatives of the terms at constant time, divided by exp(lost).
  LanePhasor change[FLYING] = {};            // zero for the drive
  double lost[LANES] = {}, last_change[LANES][6] = {};  // and the vector at the last computed due state
  Lanes slip = {};                           // derivative of the touch time
  unsigned carried = 0;                      // bits of lanes with a tangent vector
  DueStates due_states[LANES] = {};
  int waiting[LANES] = {};                   // number of due states not yet computed
  int64_t kept[LANES] = {}, impacts[LANES] = {}, events[LANES] = {};

  // Observation of each lane.
  struct Limits {
    Lanes x, p;  // a step has no new peak if |x| and |p| are below these limits at both ends
  };
  Lanes peak_x = {}, peak_p = {};            // peaks so far; infinite if no larger one need be found
  Lanes bound_x = {};                        // bound of |d2x/dt2| until the next touch
  Limits of_step = {}, of_four = {};
  LanePhasor impulse = {};                   // integral of the stops' force times exp(-i omega t) [N s]
  double first[LANES][6] = {};               // motion at the start
  unsigned observed = 0;                     // bits of observed lanes

  int64_t taken = 0;  // number of motions taken from the batch
  unsigned moving = 0, careful = 0;  // bits of lanes that advance, and of lanes that take only single steps

  // ---- One lane

  // Returns whether a motion needs fewer steps than the largest number for a run.
  static bool is_short_enough(const BatchMotion &next) {
    const Tables &t = *next.tables;
    return double(next.periods) < double(MOST_STEPS) * t.flight.grid * t.drive.frequency;
  }

  void take(int lane, BatchMotion &next) {
    const LinearTables &flight = next.tables->flight;
    const Specimen &s = next.tables->specimen;
    Phasor phasors[PHASORS];
    start_flight(phasors, next.now->motion, next.tables->drive.start, flight);
    for (int j = 0; j < FLYING; j++) {
      double size = magnitude(flight.rates[j]);
      set(term[j], lane, phasors[j] * flight.path[j]);
      set(rate[j], lane, flight.rates[j]);
      set(one_step[j], lane, {flight.ahead[j][REAL][0], flight.ahead[j][IMAG][0]});
      set(four_steps[j], lane, {flight.ahead[j][REAL][3], flight.ahead[j][IMAG][3]});
      for (int k = 0; k < ORDERS; k++) set(series[k][j], lane, {flight.series[j][REAL][k], flight.series[j][IMAG][k]});
      square[j].set(lane, flight.squares[j]), cube[j].set(lane, flight.squares[j] * size);
      for (int i = 0; i < 6; i++) shapes[lane][j][i] = quotient(flight.shapes[j][i], flight.path[j]);
      set(across[j], lane, shapes[lane][j][X]);
      across_square[j].set(lane, magnitude(shapes[lane][j][X]) * flight.squares[j]);
      if (j == DRIVEN) continue;
      Phasor impulse = (1.0 / s.m2) * flight.rows[j][VZ] - (1.0 / s.m1) * flight.rows[j][VY];
      set(kick[j], lane, next.tables->pair * (impulse * flight.path[j]));
    }
    set(drive, lane, phasors[DRIVEN] * flight.path[DRIVEN]);
    double once = 1.0 / next.tables->drive.frequency;
    period.set(lane, once), left.set(lane, once), frequency.set(lane, next.tables->drive.frequency);
    grid.set(lane, flight.grid);
    motion[lane] = &next, waiting[lane] = 0, kept[lane] = impacts[lane] = events[lane] = 0;
    bool is_observed = next.record != nullptr && next.record->watch != WATCH_NOTHING;
    observed = (observed & ~(1u << lane)) | unsigned(is_observed) << lane;
    set(impulse, lane, {0.0, 0.0});
    carried = (carried & ~(1u << lane)) | unsigned(next.tangent != nullptr) << lane;
    Tangent none{};
    const Tangent &tangent = next.tangent == nullptr ? none : *next.tangent;
    start_flight(phasors, tangent.rows[0], {0.0, 0.0}, flight);
    for (int j = 0; j < DRIVEN; j++) set(change[j], lane, phasors[j] * flight.path[j]);
    lost[lane] = tangent.growth[0];
    __builtin_memcpy(first[lane], next.now->motion, sizeof first[lane]);
    if (is_observed) see_end(*next.record, first[lane]);
    note_peaks(lane);
  }

  static Phasor one_of(const LanePhasor &of, int lane) { return {of.re[lane], of.im[lane]}; }
  static void set(LanePhasor &of, int lane, const Phasor &to) { of.re.set(lane, to.re), of.im.set(lane, to.im); }

  // Stores the due state of a lane in flight. Returns whether all states of the motion are stored.
  bool keep_due(int lane) {
    DueStates &due = due_states[lane];
    int place = waiting[lane]++;
    for (int j = 0; j < FLYING; j++) set(due.term[j], place, one_of(term[j], lane));
    if (carried >> lane & 1) {
      for (int j = 0; j < DRIVEN; j++) set(due.change[j], place, one_of(change[j], lane));
      due.lost[place] = lost[lane];
      motion[lane]->struck[kept[lane]] = impacts[lane];
    }
    due.later.set(place, left[lane]);
    left.set(lane, left[lane] + period[lane]);
    bool is_all = ++kept[lane] == motion[lane]->periods;
    if (is_all || waiting[lane] == LANES) form_states(lane);
    return is_all;
  }

  // Stores a due state during a contact.
  template <class T> bool keep_due(int lane, const T (&at)[6]) {
    form_states(lane);
    for (int i = 0; i < 6; i++) motion[lane]->sections[6 * kept[lane] + i] = value_of(at[i]);
    if constexpr (is_dual<T>) {
      double row[6];
      for (int i = 0; i < 6; i++) row[i] = at[i].slope[0];
      motion[lane]->struck[kept[lane]] = impacts[lane];
      note_growth(lane, kept[lane], row, lost[lane]);
    }
    left.set(lane, period[lane]);
    return ++kept[lane] == motion[lane]->periods;
  }

  // Computes the stored due states of a lane, and their derivatives, from the terms.
  void form_states(int lane) {
    const DueStates &due = due_states[lane];
    int64_t first = kept[lane] - waiting[lane];
    LanePhasor grows[FLYING];
    for (int j = 0; j < FLYING; j++)
      grows[j] = grown_by_series<LONG>({rate[j].re[lane], rate[j].im[lane]}, due.later);
    auto form = [&](const LanePhasor(&terms)[FLYING], auto keep) {
      for (int i = 0; i < 6; i++) {
        Lanes sum = 0.0;
        for (int j = 0; j < FLYING; j++) {
          const Phasor &shape = shapes[lane][j][i];
          sum = with_real_of_product(sum, fused_product(terms[j], grows[j]), {shape.re, shape.im});
        }
        for (int n = 0; n < waiting[lane]; n++) keep(n, i, sum[n]);
      }
    };
    double *to = motion[lane]->sections + 6 * first;
    form(due.term, [&](int n, int i, double number) { to[6 * n + i] = number; });
    if (carried >> lane & 1) {
      double rows[LANES][6];
      form(due.change, [&](int n, int i, double number) { rows[n][i] = number; });
      for (int n = 0; n < waiting[lane]; n++) note_growth(lane, first + n, rows[n], due.lost[n]);
    }
    waiting[lane] = 0;
  }

  void note_growth(int lane, int64_t place, const double (&row)[6], double removed) {
    __builtin_memcpy(last_change[lane], row, sizeof row);
    motion[lane]->growth[place] = removed + 0.5 * logarithm(inner(row, row, batch.metric));
  }

  // Keeps the tangent vectors within the range of numbers.
  void rescale(unsigned lanes) {
    Lanes square = 0.0;
    for (int j = 0; j < DRIVEN; j++)
      square = fused(change[j].re, change[j].re, fused(change[j].im, change[j].im, square));
    for_each_lane(lanes & ((Lanes(LARGEST_CHANGE) < square) | (square < 1.0 / LARGEST_CHANGE)).bits(), [&](int lane) {
      double size = square_root(square[lane]);
      if (!(0.0 < size && is_finite(size))) return;
      for (int j = 0; j < DRIVEN; j++) set(change[j], lane, {change[j].re[lane] / size, change[j].im[lane] / size});
      lost[lane] += logarithm(size);
    });
  }

  // ---- Observation of one lane

  Observer observer_of(int lane) const { return {*motion[lane]->record, *motion[lane]->tables, {}}; }

  // Stores the peaks of the record. In flight |p| cannot exceed a peak beyond the farther stop.
  void note_peaks(int lane) {
    bool is_observed = observed >> lane & 1;
    peak_x.set(lane, is_observed ? motion[lane]->record->peak_x : INFINITE);
    peak_p.set(lane, is_observed ? motion[lane]->record->peak_p : INFINITE);
    limit_steps(Mask::of(1u << lane));
  }

  // Observes the start or the end of a motion. Elsewhere x has a peak only where its rate is zero.
  static void see_end(Record &record, const double (&at)[6]) {
    record.peak_x = vibench::larger(record.peak_x, magnitude(at[X]));
    record.peak_p = vibench::larger(record.peak_p, magnitude(at[Y] - at[Z]));
  }

  // Observes the peaks of a flight that begins with the terms `now`. After the time `to_go` the next state
  // is due, and the motion may end.
  void see_flight(int lane, const LanePhasor (&now)[FLYING], double length, double to_go) {
    const LinearTables &flight = motion[lane]->tables->flight;
    Phasor phasors[PHASORS];
    for (int j = 0; j < FLYING; j++) phasors[j] = quotient(one_of(now[j], lane), flight.path[j]);
    if (kept[lane] + 1 == motion[lane]->periods) length = smaller(length, to_go);
    if (length > 0.0) observer_of(lane).see_flight(phasors, {-to_go, 0.0, 0.0}, length);
    note_peaks(lane);
  }

  // Observes the peaks of the collision that begins now, without changing the motion.
  void see_collision(int lane) {
    const Tables &own = *motion[lane]->tables;
    auto start = contact_start<double>(lane);
    Observer observer = observer_of(lane);
    Collision<double> c;
    if (start.collide(c, period[lane], batch.tolerance, own)) {
      double gap = gap_at(own.specimen, start.contact.side);
      observer.see_shape(c, gap, [&] { return times(own.collision.onto_x, c.motion); });
    } else {
      auto seen = [&](const auto &steps, double h) { observer.see_step(steps, h, start.contact); };
      double longest = STRETCH_TURN / own.omega, passed = 0.0;
      // The deepest point of every collision that the polynomials can compute lies in this stretch.
      advance_contact(start.contact, start.at, passed, longest, BaseForce(due_clock(lane), 0.5 * longest, own),
                      HertzForce{own.specimen.contact_stiffness}, batch.tolerance, own, seen);
    }
    note_peaks(lane);
  }

  void add_lines(int lane, const Motion<double> &last) {
    Observer observer = observer_of(lane);
    const Phasor &start = motion[lane]->tables->drive.start;
    observer.impulse = one_of(impulse, lane) * conjugate(start);
    Observer::End from{{}, {}, start}, to{{}, {double(motion[lane]->periods) * period[lane], 0.0, 0.0}, start};
    __builtin_memcpy(from.motion, first[lane], sizeof from.motion);
    __builtin_memcpy(to.motion, last.at, sizeof to.motion);
    observer.add_lines(from, to);
  }

  // Ends a motion in flight or on a stop.
  void end(int lane, const Contact<double> &contact) {
    BatchMotion &of = *motion[lane];
    Motion<double> last{};
    __builtin_memcpy(last.at, of.sections + 6 * (of.periods - 1), sizeof last.at);
    double begun = nearest(of.now->clock_high * frequency[lane]);
    last.clock.high = (begun + double(of.periods)) / frequency[lane];
    last.contact = contact;
    vibench::keep(*of.now, last);
    if (observed >> lane & 1) see_end(*of.record, last.at), add_lines(lane, last);
    if (of.tangent != nullptr) {
      __builtin_memcpy(of.tangent->rows[0], last_change[lane], sizeof last_change[lane]);
      of.tangent->growth[0] = lost[lane];
    }
    of.outcome = REACHED_END, of.impacts = impacts[lane];
  }
  void lose(int lane) { motion[lane]->outcome = STALLED, motion[lane]->impacts = impacts[lane]; }

  // A contact that begins at a touch.
  template <class T> struct ContactStart {
    T at[6], slip;  // `slip` contains the derivative of the time
    Contact<T> contact;
    Complex<T> drive;

    // Advances the motion by the whole collision. Returns false if that is impossible in the time `longest`.
    bool collide(Collision<T> &c, double longest, double tolerance, const Tables &own) {
      return vibench::collide(c, at, contact.side, contact.pace, drive, longest, tolerance, own);
    }
  };
  template <class T> ContactStart<T> contact_start(int lane) const {
    const Tables &own = *motion[lane]->tables;
    ContactStart<T> start{};
    double at[6], later = slip[lane];
    place_lane(at, lane);
    for (int i = 0; i < 6; i++) start.at[i] = constant<T>(at[i]);
    if constexpr (is_dual<T>) {
      start.slip.slope[0] = later;
      for (int j = 0; j < FLYING; j++) {
        Phasor moved = later * (one_of(rate[j], lane) * one_of(term[j], lane)) + one_of(change[j], lane);
        for (int i = 0; i < 6; i++) start.at[i].slope[0] += real_of_product(moved, shapes[lane][j][i]);
      }
    }
    double side = touched_side(at[Y] - at[Z], at[VY] - at[VZ], own.specimen);
    begin_contact(start.contact, start.at, side, batch.tolerance, own);
    start.contact.w = constant<T>(0.0);  // removes the rounding error: the penetration at a touch is zero
    start.drive = drive_phasor(Clock<T>{-left[lane], 0.0, start.slip}, constant<T>(0.0), own);
    return start;
  }
  // The next state is due at clock time zero, a whole number of drive periods after the start.
  Clock<double> due_clock(int lane) const { return {-left[lane], 0.0, 0.0}; }

  enum class SlowContact { LEFT, ENDED, LOST };

  // Integrates a contact of one lane as a whole or in steps, and stores the states that become due meanwhile.
  template <class T> SlowContact contact_alone(int lane) {
    const Tables &own = *motion[lane]->tables;
    auto start = contact_start<T>(lane);
    T(&at)[6] = start.at, &slip = start.slip;
    Contact<T> &contact = start.contact;
    HertzForce force{own.specimen.contact_stiffness};
    bool is_observed = observed >> lane & 1;
    Record unused{};
    Observer observer{is_observed ? *motion[lane]->record : unused, own, {}};
    auto seen = [&](const auto &steps, const T &h) {
      if (is_observed) observer.see_step(steps, value_of(h), contact);
    };
    if (Collision<T> c; start.collide(c, left[lane], batch.tolerance, own)) {
      if (is_observed)
        observer.see_collision(values_of(c), contact.side, {value_of(start.drive.re), value_of(start.drive.im)});
      add_impulse(lane, observer);
      left.set(lane, left[lane] - value_of(c.duration));
      slip = slip + slopes_only(c.duration);
      contact.side = 0.0;
    }
    while (contact.side != 0.0) {
      double longest = STRETCH_TURN / own.omega;
      bool is_due = left[lane] <= longest;
      if (is_due) longest = left[lane];
      BaseForce base(due_clock(lane), 0.5 * longest, own);
      T limit = constant<T>(longest), passed = slip;
      ContactEnd end = advance_contact(contact, at, passed, limit, base, force, batch.tolerance, own, seen);
      if (end != ContactEnd::LEFT && end != ContactEnd::HELD) return SlowContact::LOST;
      left.set(lane, left[lane] - value_of(passed));
      slip = slopes_only(passed);
      add_impulse(lane, observer);
      if (is_due && end == ContactEnd::HELD && keep_due(lane, at)) {
        Motion<T> last{};
        last.contact = contact;
        this->end(lane, values_of(last).contact);
        return SlowContact::ENDED;
      }
    }
    Complex<T> phasors[PHASORS];
    Phasor values[PHASORS];
    Clock<T> clock{-left[lane], 0.0, slip};
    start_flight(phasors, at, drive_phasor(clock, constant<T>(0.0), own), own.flight);
    copy_values(values, phasors, own.flight);
    for (int j = 0; j < FLYING; j++) {
      Phasor of_p = values[j] * own.flight.path[j];
      set(term[j], lane, of_p);
      if constexpr (is_dual<T>) {
        if (j == DRIVEN) continue;
        Phasor moved = Phasor{phasors[j].re.slope[0], phasors[j].im.slope[0]} * own.flight.path[j];
        moved = moved - slip.slope[0] * (one_of(rate[j], lane) * of_p);
        set(change[j], lane, moved);
      }
    }
    note_peaks(lane);
    return SlowContact::LEFT;
  }

  // Moves the impulse of a contact computed in steps, which has the drive's phase, to the lane's impulse.
  void add_impulse(int lane, Observer &observer) {
    set(impulse, lane, one_of(impulse, lane) + observer.impulse * motion[lane]->tables->drive.start);
    observer.impulse = {0.0, 0.0};
  }

  void place_lane(double *at, int lane) const {
    for (int i = 0; i < 6; i++) {
      at[i] = 0.0;
      for (int j = 0; j < FLYING; j++) at[i] += real_of_product(one_of(term[j], lane), shapes[lane][j][i]);
    }
  }

  // ---- Functions for several lanes. They do not change the other lanes.

  unsigned keep_due(unsigned due) {
    unsigned over = 0;
    for_each_lane(due, [&](int lane) {
      if (!keep_due(lane)) return;
      end(lane, {});
      over |= 1u << lane;
    });
    return over;
  }

  // Computes the bounds of the flights from their terms.
  void bound_flights(unsigned lanes) {
    Mask of = Mask::of(lanes);
    Lanes sizes = 0.0, squares = 0.0, cubes = 0.0, x_squares = 0.0;
    for (int j = 0; j < FLYING; j++) {
      Lanes size = square_root(fused(term[j].re, term[j].re, term[j].im * term[j].im));
      sizes = sizes + size;
      squares = fused(size, square[j], squares), cubes = fused(size, cube[j], cubes);
      x_squares = fused(size, across_square[j], x_squares);
    }
    Lanes margin = squares * (grid * grid) * 0.125;
    reach = select(of, sizes, reach), bound = select(of, squares, bound), jerk = select(of, cubes, jerk);
    low = select(of, margin - lower, low), high = select(of, upper - margin, high);
    low_four = select(of, FOUR * FOUR * margin - lower, low_four);
    high_four = select(of, upper - FOUR * FOUR * margin, high_four);
    bound_x = select(of, x_squares, bound_x);
    limit_steps(of);
  }

  // Computes the limits of |x| and |p| below which a step contains no new peak.
  void limit_steps(Mask of) {
    double farther = vibench::larger(lower, upper);
    Lanes part = grid * grid * 0.125, least_p = select(peak_p < farther, peak_p, INFINITE);
    of_step.x = select(of, peak_x - bound_x * part, of_step.x);
    of_step.p = select(of, least_p - bound * part, of_step.p);
    of_four.x = select(of, peak_x - FOUR * FOUR * bound_x * part, of_four.x);
    of_four.p = select(of, least_p - FOUR * FOUR * bound * part, of_four.p);
  }

  // Advances until at most `enough` lanes are clear of the stops. Returns the lanes with a due state.
  template <bool IS_OBSERVED, bool IS_CARRIED> unsigned march(int enough) {
    Mask going = Mask::of(moving), one_by_one = Mask::of(careful);
    LanePhasor now[FLYING], next[FLYING], factor[FLYING], moved[DRIVEN];
    for (int j = 0; j < FLYING; j++) now[j] = term[j];
    for (int j = 0; j < DRIVEN; j++) moved[j] = change[j];
    Lanes to_go = left, p = sum_of_terms(now), x = x_of(now);
    for (;;) {
      Mask four = (low_four < p) & (p < high_four) & ~one_by_one, clear = going & (low < p) & (p < high);
      for (int j = 0; j < FLYING; j++) factor[j] = select(four, four_steps[j], one_step[j]);
      for (int j = 0; j < FLYING; j++) next[j] = fused_product(now[j], factor[j]);
      Lanes ahead = sum_of_terms(next);
      clear = clear & (select(four, low_four, low) < ahead) & (ahead < select(four, high_four, high));
      if constexpr (IS_OBSERVED) {
        Lanes x_ahead = x_of(next), largest_x = larger(magnitude(x), magnitude(x_ahead));
        Lanes largest_p = larger(magnitude(p), magnitude(ahead));
        Mask over_x = clear & (select(four, of_four.x, of_step.x) < largest_x);
        Mask over_p = clear & (select(four, of_four.p, of_step.p) < largest_p);
        if ((over_x | over_p).bits() != 0) {
          Lanes step = select(four, FOUR * grid, grid);
          Mask may_turn = ~(bound_x * step < magnitude(rate_of_x(now)));
          for_each_lane((over_p | (over_x & may_turn)).bits(),
                        [&](int lane) { see_flight(lane, now, step[lane], to_go[lane]); });
        }
        x = select(clear, x_ahead, x);
      }
      for (int j = 0; j < FLYING; j++) now[j] = select(clear, next[j], now[j]);
      if constexpr (IS_CARRIED)
        for (int j = 0; j < DRIVEN; j++) moved[j] = select(clear, fused_product(moved[j], factor[j]), moved[j]);
      p = select(clear, ahead, p);
      to_go = to_go - select(clear, select(four, FOUR * grid, grid), 0.0);
      one_by_one = one_by_one | (four & ~clear);
      going = going & (clear | four);
      unsigned due = (clear & ~(0.0 < to_go)).bits();
      if (due != 0 || __builtin_popcount(going.bits()) <= enough) {
        for (int j = 0; j < FLYING; j++) term[j] = now[j];
        for (int j = 0; j < DRIVEN; j++) change[j] = moved[j];
        left = to_go, moving = going.bits(), careful = one_by_one.bits();
        return due;
      }
    }
  }

  static INLINE Lanes sum_of_terms(const LanePhasor (&of)[FLYING]) {
    return (of[0].re + of[1].re) + (of[2].re + of[3].re);
  }

  INLINE Lanes x_of(const LanePhasor (&terms)[FLYING]) const {
    Lanes sums[2] = {};
    for (int j = 0; j < FLYING; j++) sums[j % 2] = with_real_of_product(sums[j % 2], terms[j], across[j]);
    return sums[0] + sums[1];
  }

  INLINE Lanes rate_of_x(const LanePhasor (&terms)[FLYING]) const {
    Lanes sum = 0.0;
    for (int j = 0; j < FLYING; j++) sum = with_real_of_product(sum, fused_product(terms[j], rate[j]), across[j]);
    return sum;
  }

  // Returns which lanes may have a new peak of x in the next `time`, at most a grid step or a collision.
  Mask may_peak(Mask of, Lanes time) const {
    Lanes speed = magnitude(rate_of_x(term)), bend = SPARE * bound_x * time;
    return of & ~(bend < speed) & (peak_x < fused(speed + bend, time, magnitude(x_of(term))));
  }

  // Observes the peaks of a flight of at most one grid step.
  void see_short_flight(unsigned lanes, Lanes time) {
    double farther = vibench::larger(lower, upper);
    Mask of = Mask::of(lanes & observed);
    if (of.bits() == 0) return;
    for_each_lane((may_peak(of, time) | (of & (peak_p < farther) & (peak_p < reach))).bits(),
                  [&](int lane) { see_flight(lane, term, time[lane], left[lane]); });
  }

  // Computes p and its derivatives, each divided by the factorial of its order.
  INLINE void fill_course(Lanes (&course)[ORDERS]) const {
    course[0] = sum_of_terms(term);
    for (int k = 1; k < ORDERS; k++) {
      course[k] = 0.0;
      for (int j = 0; j < FLYING; j++) course[k] = with_real_of_product(course[k], term[j], series[k][j]);
    }
  }
  static INLINE void place_on(const Lanes (&course)[ORDERS], Lanes time, Lanes &p, Lanes &rate) {
    p = course[ORDERS - 1], rate = 0.0;
    for (int k = ORDERS - 2; k >= 0; k--) rate = fused(rate, time, p), p = fused(p, time, course[k]);
  }

  // Finds the first touch within the next grid step, like `first_touch`. Returns the lanes that touch.
  unsigned look_closely(unsigned lanes) {
    Lanes course[ORDERS];
    fill_course(course);
    Mask rises = Lanes(0.0) < course[1];
    Lanes side = select(rises, 1.0, -1.0), stop = select(rises, upper, lower);
    Lanes speed = side * course[1], bend = 2.0 * side * course[2], change = bound * grid * LONGEST_TURN;
    Mask proved = (change < speed) & (change < fused(bend, grid, speed));
    Lanes closed = fused(reach, ROUNDING, TOUCH * smaller(lower, upper)), p, p_rate;
    place_on(course, grid, p, p_rate);
    Mask touches = (stop - side * p) < closed;
    Lanes gap = stop - side * course[0];
    Lanes later = 2.0 * gap / (speed + square_root(fused(speed, speed, 2.0 * bend * gap))), step = later;
    for (int n = 0; n < TOUCH_CORRECTIONS; n++) {
      later = select(later < grid, later, grid);
      place_on(course, later, p, p_rate);
      step = (stop - side * p) / (side * p_rate);
      later = later + step;
    }
    later = select(Lanes(0.0) < later, later, 0.0);
    later = select(later < grid, later, grid);
    proved = proved & (~touches | (bound * step * step < closed));
    Mask at_once = gap < closed;
    touch = select(at_once, 0.0, later);
    unsigned touched = lanes & (proved & (touches | at_once)).bits();
    for_each_lane(lanes & ~proved.bits(), [&](int lane) {
      double one[AHEAD] = {};
      for (int k = 0; k < ORDERS; k++) one[k] = course[k][lane];
      double found = first_contact(one, grid[lane], {lower, upper, bound[lane], reach[lane]});
      touch.set(lane, found);
      if (found != NEVER) touched |= 1u << lane;
    });
    return touched;
  }

  // Advances the time. The drive's term is recomputed, so that its rounding errors do not accumulate.
  // Returns exp(i omega t) at the new time.
  LanePhasor pass(Mask of, Lanes time) {
    left = left - select(of, time, 0.0);
    // The series needs a small angle: (phase + half a turn) / 4. Its result is raised to the fourth power.
    LanePhasor turned = turned_by_series<LONG>((0.5 - left * frequency) * (0.5 * PI));
    LanePhasor half{fused(turned.re, turned.re, -(turned.im * turned.im)), 2.0 * (turned.re * turned.im)};
    LanePhasor whole{fused(half.im, half.im, -(half.re * half.re)), -2.0 * (half.re * half.im)};
    term[DRIVEN] = select(of, fused_product(drive, whole), term[DRIVEN]);
    return whole;
  }

  void fly_to_touch(unsigned lanes) {
    Mask of = Mask::of(lanes);
    Lanes later = select(of, touch, 0.0);
    see_short_flight(lanes, later);
    for (int j = 0; j < DRIVEN; j++) {
      LanePhasor grows = grown_by_series<SHORT>(rate[j], later);
      term[j] = select(of, fused_product(term[j], grows), term[j]);
      change[j] = select(of, fused_product(change[j], grows), change[j]);
    }
    pass(of, later);
  }

  // Advances a flight by one grid step. Returns the lanes with a due state.
  unsigned fly_step(unsigned lanes) {
    Mask of = Mask::of(lanes);
    see_short_flight(lanes, grid);
    for (int j = 0; j < FLYING; j++) term[j] = select(of, fused_product(term[j], one_step[j]), term[j]);
    for (int j = 0; j < DRIVEN; j++) change[j] = select(of, fused_product(change[j], one_step[j]), change[j]);
    left = left - select(of, grid, 0.0);
    return (of & ~(0.0 < left)).bits();
  }

  // Computes the collisions of lanes that touch a stop. Returns the lanes outside the polynomials' range.
  // Lanes in `last` end at their next due state; they are also returned if that state is due in a collision.
  template <class T> unsigned collide(unsigned lanes, unsigned last) {
    Complex<T> at_touch[FLYING];
    T approach{};
    fill_terms(at_touch);
    for (int j = 0; j < FLYING; j++) approach = with_real_of_product(approach, at_touch[j], rate[j]);
    Lanes side = select(Lanes(0.0) < value_of(approach), 1.0, -1.0), speed = magnitude(value_of(approach));
    Lanes fourth = square_root(square_root(speed)), root = fit.guess[0];
    for (int n = 1; n < 4; n++) root = fused(root, fourth, fit.guess[n]);
    for (int n = 0; n < ROOT_CORRECTIONS; n++) {  // Newton's method for speed^(-1/5)
      Lanes twice = root * root;
      root = root * fused(-0.2 * (speed * twice), twice * root, 1.2);
    }
    Lanes scale = side / speed;
    T unit = chained(fit.unit * root, -0.2 * fit.unit * root * scale, approach);
    T variables[VARIABLES], values[POLYNOMIALS];
    fill_variables(variables, at_touch, chained(scale, -scale * scale, approach), unit);
    Lanes press = value_of(variables[0]), by_press = fused(fused(press, DEEPEST[2], DEEPEST[1]), press, DEEPEST[0]);
    Lanes deepest = speed * value_of(unit) * fused(value_of(variables[1]), DEEPER_BY_CHANGE, by_press);
    Mask inside = Mask::of(lanes) & (Lanes(0.0) < speed);
    for (int k = 0; k < VARIABLES; k++) {
      variables[k] = (variables[k] - fit.middle[k]) * (1.0 / fit.half[k]);
      inside = inside & (magnitude(value_of(variables[k])) < 1.0);
    }
    evaluate(values, variables, fit.coefficients);
    T duration = unit * values[0];
    Lanes length = value_of(duration);
    inside = inside & (length * frequency < LONGEST_PART) & ~(Mask::of(last) & (left < length));
    if (observed != 0) see_collisions(inside, side, deepest, length);
    kick_modes(inside, at_touch, duration, unit, approach, values);
    LanePhasor end = pass(inside, length);
    if (observed != 0) {
      Lanes plain[POLYNOMIALS];
      for (int n = 0; n < POLYNOMIALS; n++) plain[n] = value_of(values[n]);
      add_impulses(inside, 0.5 * length, value_of(unit), tables.pair * side * speed, end, plain);
    }
    return lanes & ~inside.bits();
  }

  // Copies the terms at a touch. Their derivatives contain the derivative of the touch time, `slip`.
  void fill_terms(LanePhasor (&terms)[FLYING]) { __builtin_memcpy(terms, term, sizeof terms); }
  void fill_terms(Complex<LaneDual> (&terms)[FLYING]) {
    Lanes closing = 0.0, speed = 0.0;
    for (int j = 0; j < FLYING; j++) speed = with_real_of_product(speed, term[j], rate[j]);
    for (int j = 0; j < DRIVEN; j++) closing = closing + change[j].re;
    Lanes least = select(speed < 0.0, -SLOWEST_TOUCH, SLOWEST_TOUCH);
    slip = -closing / select(magnitude(speed) < SLOWEST_TOUCH, least, speed);
    for (int j = 0; j < FLYING; j++) {
      LanePhasor turns = fused_product(rate[j], term[j]);
      LanePhasor moved = LanePhasor{turns.re * slip, turns.im * slip} + change[j];
      terms[j] = {{term[j].re, {moved.re}}, {term[j].im, {moved.im}}};
    }
  }

  // Computes the variables of the polynomials: acceleration at the collision's middle, its derivatives, and
  // u, in units of the collision. `scale` is side / speed, which normalises the rate of p to 1.
  template <class T>
  INLINE void fill_variables(T (&variables)[VARIABLES], const Complex<T> (&terms)[FLYING], T scale, T unit) const {
    for (int k = 0; k < DERIVATIVES; k++) variables[k] = T{};
    variables[DERIVATIVES] = unit;
    for (int order = 2; order <= HIGHEST; order++) {
      T value{};
      for (int j = 0; j < FLYING; j++) value = with_real_of_product(value, terms[j], series[order][j]);
      scale = scale * unit;
      value = value * scale * (1.0 / INVERSE_FACTORIALS.of[order]);
      double away = 1.0;  // COLLISION_MIDDLE^n / n! for the derivative of an order lower by n
      for (int k = order - 2; k >= 0; k--) {
        if (k < DERIVATIVES) variables[k] = fused(value, Lanes(away), variables[k]);
        away *= COLLISION_MIDDLE / (order - 1 - k);
      }
    }
  }

  // Returns the integral of F exp(rate (T / 2 - t)) dt over a collision of duration T, divided by the
  // impulse `pair` times the approach speed.
  template <class T>
  static INLINE Complex<T> weighted_force(const LanePhasor &rate, const T &unit, const T (&values)[POLYNOMIALS]) {
    Complex<T> turn{rate.re * unit, rate.im * unit}, sum{(1.0 / (MOMENTS - 1)) * values[MOMENTS], T{}};
    for (int m = MOMENTS - 2; m >= 0; m--) {
      sum = {fused(sum.re, turn.re, fused(-sum.im, turn.im, values[1 + m])),
             fused(sum.re, turn.im, sum.im * turn.re)};
      if (m > 1) sum = {(1.0 / m) * sum.re, (1.0 / m) * sum.im};
    }
    return sum;
  }

  // Advances the modes by half a collision, adds its impulse, and advances them by the other half.
  template <class T>
  INLINE void kick_modes(Mask of, const Complex<T> (&terms)[FLYING], const T &length, const T &unit, const T &push,
                         const T (&values)[POLYNOMIALS]) {
    for (int j = 0; j < DRIVEN; j++) {
      Complex<T> by = grown_by_series<SHORT>(rate[j], 0.5 * length), sum = weighted_force(rate[j], unit, values);
      Complex<T> pushed = fused_product(sum, Complex<T>{push * kick[j].re, push * kick[j].im});
      Complex<T> end = fused_product(fused_product(terms[j], by) + pushed, by);
      term[j] = select(of, {value_of(end.re), value_of(end.im)}, term[j]);
      if constexpr (is_dual<T>) {
        Lanes later = slip + length.slope[0];
        LanePhasor turns = fused_product(rate[j], term[j]);
        LanePhasor moved{end.re.slope[0] - later * turns.re, end.im.slope[0] - later * turns.im};
        change[j] = select(of, moved, change[j]);
      }
    }
  }

  // Observes the peaks of collisions that begin now.
  void see_collisions(Mask of, Lanes side, Lanes deepest, Lanes length) {
    Mask higher = of & (peak_p < select(Lanes(0.0) < side, upper, lower) + deepest);
    for_each_lane((may_peak(of, length) | higher).bits() & observed, [&](int lane) { see_collision(lane); });
  }

  // Adds the impulses of collisions that end now, with the phase exp(-i omega t) of the force.
  void add_impulses(Mask of, Lanes half, Lanes unit, Lanes push, const LanePhasor &end,
                    const Lanes (&values)[POLYNOMIALS]) {
    LanePhasor line = weighted_force(rate[DRIVEN], unit, values);
    line = fused_product(line, turned_by_series<SHORT>(rate[DRIVEN].im * half));
    line = fused_product(line, conjugate(end));
    impulse = select(of, {fused(push, line.re, impulse.re), fused(push, line.im, impulse.im)}, impulse);
  }

  // Returns the lanes whose first step after a contact has provably no touch.
  unsigned leaves_clear(unsigned lanes) const {
    Lanes rate_of_p = 0.0, half_bend = 0.0;
    for (int j = 0; j < FLYING; j++) {
      rate_of_p = with_real_of_product(rate_of_p, term[j], rate[j]);
      half_bend = with_real_of_product(half_bend, term[j], series[2][j]);
    }
    Lanes speed = magnitude(rate_of_p), half = select(Lanes(0.0) < rate_of_p, half_bend, -half_bend);
    Lanes change = jerk * (grid * grid) * (1.0 / 6.0);
    Lanes farthest = fused(magnitude(half), grid, speed + change) * grid;
    Mask clear = (change < fused(half, grid, speed)) & (farthest < lower + upper);
    return lanes & clear.bits();
  }
};

inline void BatchRun::follow() {
  unsigned alive = 0, over = ALL_LANES;
  for (;;) {
    if (over != 0) {
      alive &= ~over, moving &= ~over, careful &= ~over;
      for_each_lane(over, [&](int lane) {
        for (; taken < batch.count && !is_short_enough(batch.motions[taken]); taken++)
          batch.motions[taken].outcome = TOO_LONG;
        if (taken == batch.count) return;
        take(lane, batch.motions[taken++]);
        alive |= 1u << lane, moving |= 1u << lane;
      });
      if (alive == 0) return;
      bound_flights(over);
      over = 0;
    }
    int enough = alive == ALL_LANES ? WAITING : 0;
    if (__builtin_popcount(moving) > enough) {
      over = keep_due(carried != 0 ? observed != 0 ? march<true, true>(enough) : march<false, true>(enough)
                      : observed != 0 ? march<true, false>(enough) : march<false, false>(enough));
      if (over != 0 || __builtin_popcount(moving) > enough) continue;
    }
    unsigned stopped = alive & ~moving;
    careful &= ~stopped;
    for_each_lane(stopped, [&](int lane) {
      if (++events[lane] <= MOST_EVENTS * motion[lane]->periods && bound[lane] < LARGEST_BOUND) return;
      lose(lane);
      over |= 1u << lane;
    });
    stopped &= ~over;
    unsigned touched = look_closely(stopped), clear = stopped & ~touched;
    over |= keep_due(fly_step(clear));
    moving |= clear;
    bound_flights(clear);
    if (touched == 0) continue;
    fly_to_touch(touched);
    unsigned ended = keep_due(touched & ~(0.0 < left).bits()), last = 0;
    over |= ended, touched &= ~ended;
    for_each_lane(touched, [&](int lane) {
      impacts[lane]++;
      if (kept[lane] + 1 == motion[lane]->periods) last |= 1u << lane;
    });
    for_each_lane(carried != 0 ? collide<LaneDual>(touched, last) : collide<Lanes>(touched, last), [&](int lane) {
      SlowContact ends = carried >> lane & 1 ? contact_alone<Dual<double, 1>>(lane) : contact_alone<double>(lane);
      if (ends == SlowContact::LOST) lose(lane);
      if (ends != SlowContact::LEFT) over |= 1u << lane;
    });
    touched &= ~over;
    rescale(touched & carried);
    over |= keep_due(touched & ~(0.0 < left).bits());
    touched &= ~over;
    bound_flights(touched);
    unsigned away = leaves_clear(touched);
    over |= keep_due(fly_step(away));
    moving |= away;
  }
}

inline int64_t follow_batch(const Batch &batch) {
  if (batch.count > 0) BatchRun(batch).follow();
  return REACHED_END;
}

}  // namespace vibench
