// Eight motions of one specimen in parallel, one per lane of a vector register (decision 0061). In flight, p
// is the real part of a sum of four rotating phasors ("terms"). Lanes advance by grid steps, as in
// flight.hpp, until at most one lane is clear of the stops. Then the touch, the collision (by polynomials)
// and the first step after it are computed for the other lanes, under masks. A lane with a finished motion
// takes the next motion of the batch. Other lanes can delay a motion, but never change its results.
//
// Observed motions: lines need only the moments of each collision's force. New peaks are rare, and bounds
// exclude almost all steps and collisions. The others are observed one by one, as in observe.hpp.
#pragma once
#include "collision_fit.hpp"
#include "observe.hpp"

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
constexpr int64_t MOST_EVENTS = 10000;    // limit of the mean number of events per drive period
static_assert(HIGHEST < ORDERS && ORDERS <= AHEAD);

using Lanes = Vector<LANES>;
using LanePhasor = Complex<Lanes>;

struct InverseFactorials {
  double of[2 * LONG];
  constexpr InverseFactorials() : of{} {
    double factorial = 1.0;  // exact: the odd part of 19! fits into 53 bits
    for (int k = 0; k < 2 * LONG; k++) of[k] = 1.0 / factorial, factorial *= k + 1;
  }
};
constexpr InverseFactorials INVERSE_FACTORIALS;

INLINE LanePhasor fused_product(const LanePhasor &x, const LanePhasor &y) {
  return {fused(x.re, y.re, -(x.im * y.im)), fused(x.re, y.im, x.im * y.re)};
}
// Returns sum + Re(x y).
INLINE Lanes with_real_of_product(Lanes sum, const LanePhasor &x, const LanePhasor &y) {
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
    LanePhasor term[FLYING];
    Lanes later;  // due time minus time of the terms, zero or negative [s]
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
    auto set = [&](LanePhasor &to, const Phasor &value) { to.re.set(lane, value.re), to.im.set(lane, value.im); };
    for (int j = 0; j < FLYING; j++) {
      double size = magnitude(flight.rates[j]);
      set(term[j], phasors[j] * flight.path[j]);
      set(rate[j], flight.rates[j]);
      set(one_step[j], {flight.ahead[j][REAL][0], flight.ahead[j][IMAG][0]});
      set(four_steps[j], {flight.ahead[j][REAL][3], flight.ahead[j][IMAG][3]});
      for (int k = 0; k < ORDERS; k++) set(series[k][j], {flight.series[j][REAL][k], flight.series[j][IMAG][k]});
      square[j].set(lane, flight.squares[j]), cube[j].set(lane, flight.squares[j] * size);
      for (int i = 0; i < 6; i++) shapes[lane][j][i] = quotient(flight.shapes[j][i], flight.path[j]);
      set(across[j], shapes[lane][j][X]);
      across_square[j].set(lane, magnitude(shapes[lane][j][X]) * flight.squares[j]);
      if (j == DRIVEN) continue;
      Phasor impulse = (1.0 / s.m2) * flight.rows[j][VZ] - (1.0 / s.m1) * flight.rows[j][VY];
      set(kick[j], next.tables->pair * (impulse * flight.path[j]));
    }
    set(drive, phasors[DRIVEN] * flight.path[DRIVEN]);
    double once = 1.0 / next.tables->drive.frequency;
    period.set(lane, once), left.set(lane, once), frequency.set(lane, next.tables->drive.frequency);
    grid.set(lane, flight.grid);
    motion[lane] = &next, waiting[lane] = 0, kept[lane] = impacts[lane] = events[lane] = 0;
    bool is_observed = next.record != nullptr && next.record->watch != WATCH_NOTHING;
    observed = (observed & ~(1u << lane)) | unsigned(is_observed) << lane;
    set(impulse, {0.0, 0.0});
    __builtin_memcpy(first[lane], next.now->motion, sizeof first[lane]);
    if (is_observed) see_end(*next.record, first[lane]);
    note_peaks(lane);
  }

  Phasor term_of(int lane, int j) const { return {term[j].re[lane], term[j].im[lane]}; }

  // Stores the due state of a lane in flight. Returns whether all states of the motion are stored.
  bool keep_due(int lane) {
    DueStates &due = due_states[lane];
    int place = waiting[lane]++;
    for (int j = 0; j < FLYING; j++) {
      Phasor now = term_of(lane, j);
      due.term[j].re.set(place, now.re), due.term[j].im.set(place, now.im);
    }
    due.later.set(place, left[lane]);
    left.set(lane, left[lane] + period[lane]);
    bool is_all = ++kept[lane] == motion[lane]->periods;
    if (is_all || waiting[lane] == LANES) form_states(lane);
    return is_all;
  }

  // Stores a due state during a contact.
  bool keep_due(int lane, const double (&at)[6]) {
    form_states(lane);
    __builtin_memcpy(motion[lane]->sections + 6 * kept[lane], at, sizeof at);
    left.set(lane, period[lane]);
    return ++kept[lane] == motion[lane]->periods;
  }

  // Computes the stored due states of a lane from their terms.
  void form_states(int lane) {
    const DueStates &due = due_states[lane];
    double *to = motion[lane]->sections + 6 * (kept[lane] - waiting[lane]);
    LanePhasor there[FLYING];
    for (int j = 0; j < FLYING; j++)
      there[j] = fused_product(due.term[j], grown_by_series<LONG>({rate[j].re[lane], rate[j].im[lane]}, due.later));
    for (int i = 0; i < 6; i++) {
      Lanes sum = 0.0;
      for (int j = 0; j < FLYING; j++) {
        const Phasor &shape = shapes[lane][j][i];
        sum = with_real_of_product(sum, there[j], {shape.re, shape.im});
      }
      for (int n = 0; n < waiting[lane]; n++) to[6 * n + i] = sum[n];
    }
    waiting[lane] = 0;
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
    for (int j = 0; j < FLYING; j++) phasors[j] = quotient({now[j].re[lane], now[j].im[lane]}, flight.path[j]);
    if (kept[lane] + 1 == motion[lane]->periods) length = smaller(length, to_go);
    if (length > 0.0) observer_of(lane).see_flight(phasors, {-to_go, 0.0, 0.0}, length);
    note_peaks(lane);
  }

  // Observes the peaks of the collision that begins now, without changing the motion.
  void see_collision(int lane) {
    const Tables &own = *motion[lane]->tables;
    ContactStart start = contact_start(lane);
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
    observer.impulse = Phasor{impulse.re[lane], impulse.im[lane]} * conjugate(start);
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
    of.outcome = REACHED_END, of.impacts = impacts[lane];
  }
  void lose(int lane) { motion[lane]->outcome = STALLED, motion[lane]->impacts = impacts[lane]; }

  // A contact that begins at a touch.
  struct ContactStart {
    double at[6];
    Contact<double> contact;
    Phasor drive;

    // Advances the motion by the whole collision. Returns false if that is impossible in the time `longest`.
    bool collide(Collision<double> &c, double longest, double tolerance, const Tables &own) {
      return vibench::collide(c, at, contact.side, contact.pace, drive, longest, tolerance, own);
    }
  };
  ContactStart contact_start(int lane) const {
    const Tables &own = *motion[lane]->tables;
    ContactStart start{};
    place_lane(start.at, lane);
    double side = touched_side(start.at[Y] - start.at[Z], start.at[VY] - start.at[VZ], own.specimen);
    begin_contact(start.contact, start.at, side, batch.tolerance, own);
    start.contact.w = 0.0;  // removes the rounding error: the penetration at a touch is zero
    start.drive = drive_phasor(due_clock(lane), 0.0, own);
    return start;
  }
  // The next state is due at clock time zero, a whole number of drive periods after the start.
  Clock<double> due_clock(int lane) const { return {-left[lane], 0.0, 0.0}; }

  enum class SlowContact { LEFT, ENDED, LOST };

  // Integrates a contact of one lane as a whole or in steps, and stores the states that become due meanwhile.
  SlowContact contact_alone(int lane) {
    const Tables &own = *motion[lane]->tables;
    ContactStart start = contact_start(lane);
    double(&at)[6] = start.at;
    Contact<double> &contact = start.contact;
    HertzForce force{own.specimen.contact_stiffness};
    bool is_observed = observed >> lane & 1;
    Record unused{};
    Observer observer{is_observed ? *motion[lane]->record : unused, own, {}};
    auto seen = [&](const auto &steps, double h) {
      if (is_observed) observer.see_step(steps, h, contact);
    };
    if (Collision<double> c; start.collide(c, left[lane], batch.tolerance, own)) {
      if (is_observed) observer.see_collision(c, contact.side, start.drive);
      add_impulse(lane, observer);
      left.set(lane, left[lane] - c.duration);
      contact.side = 0.0;
    }
    while (contact.side != 0.0) {
      double longest = STRETCH_TURN / own.omega, passed = 0.0;
      bool is_due = left[lane] <= longest;
      if (is_due) longest = left[lane];
      BaseForce base(due_clock(lane), 0.5 * longest, own);
      ContactEnd end = advance_contact(contact, at, passed, longest, base, force, batch.tolerance, own, seen);
      if (end != ContactEnd::LEFT && end != ContactEnd::HELD) return SlowContact::LOST;
      left.set(lane, left[lane] - passed);
      add_impulse(lane, observer);
      if (is_due && end == ContactEnd::HELD && keep_due(lane, at)) {
        this->end(lane, contact);
        return SlowContact::ENDED;
      }
    }
    Phasor phasors[PHASORS], now = drive_phasor(due_clock(lane), 0.0, own);
    start_flight(phasors, at, now, own.flight);
    for (int j = 0; j < FLYING; j++) {
      Phasor of_p = phasors[j] * own.flight.path[j];
      term[j].re.set(lane, of_p.re), term[j].im.set(lane, of_p.im);
    }
    note_peaks(lane);
    return SlowContact::LEFT;
  }

  // Moves the impulse of a contact computed in steps, which has the drive's phase, to the lane's impulse.
  void add_impulse(int lane, Observer &observer) {
    Phasor sum = observer.impulse * motion[lane]->tables->drive.start;
    impulse.re.set(lane, impulse.re[lane] + sum.re), impulse.im.set(lane, impulse.im[lane] + sum.im);
    observer.impulse = {0.0, 0.0};
  }

  void place_lane(double *at, int lane) const {
    for (int i = 0; i < 6; i++) {
      at[i] = 0.0;
      for (int j = 0; j < FLYING; j++) at[i] += real_of_product(term_of(lane, j), shapes[lane][j][i]);
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
  template <bool IS_OBSERVED> unsigned march(int enough) {
    Mask going = Mask::of(moving), one_by_one = Mask::of(careful);
    LanePhasor now[FLYING], next[FLYING];
    for (int j = 0; j < FLYING; j++) now[j] = term[j];
    Lanes to_go = left, p = sum_of_terms(now), x = x_of(now);
    for (;;) {
      Mask four = (low_four < p) & (p < high_four) & ~one_by_one, clear = going & (low < p) & (p < high);
      for (int j = 0; j < FLYING; j++) next[j] = fused_product(now[j], select(four, four_steps[j], one_step[j]));
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
      p = select(clear, ahead, p);
      to_go = to_go - select(clear, select(four, FOUR * grid, grid), 0.0);
      one_by_one = one_by_one | (four & ~clear);
      going = going & (clear | four);
      unsigned due = (clear & ~(0.0 < to_go)).bits();
      if (due != 0 || __builtin_popcount(going.bits()) <= enough) {
        for (int j = 0; j < FLYING; j++) term[j] = now[j];
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
    for (int j = 0; j < DRIVEN; j++)
      term[j] = select(of, fused_product(term[j], grown_by_series<SHORT>(rate[j], later)), term[j]);
    pass(of, later);
  }

  // Advances a flight by one grid step. Returns the lanes with a due state.
  unsigned fly_step(unsigned lanes) {
    Mask of = Mask::of(lanes);
    see_short_flight(lanes, grid);
    for (int j = 0; j < FLYING; j++) term[j] = select(of, fused_product(term[j], one_step[j]), term[j]);
    left = left - select(of, grid, 0.0);
    return (of & ~(0.0 < left)).bits();
  }

  // Computes the collisions of lanes that touch a stop. Returns the lanes outside the polynomials' range.
  // Lanes in `last` end at their next due state; they are also returned if that state is due in a collision.
  unsigned collide(unsigned lanes, unsigned last) {
    Lanes approach = 0.0;
    for (int j = 0; j < FLYING; j++) approach = with_real_of_product(approach, term[j], rate[j]);
    Lanes side = select(Lanes(0.0) < approach, 1.0, -1.0), speed = magnitude(approach);
    Lanes fourth = square_root(square_root(speed)), root = fit.guess[0];
    for (int n = 1; n < 4; n++) root = fused(root, fourth, fit.guess[n]);
    for (int n = 0; n < ROOT_CORRECTIONS; n++) {  // Newton's method for speed^(-1/5)
      Lanes twice = root * root;
      root = root * fused(-0.2 * (speed * twice), twice * root, 1.2);
    }
    Lanes unit = fit.unit * root, variables[VARIABLES], values[POLYNOMIALS];
    fill_variables(variables, side / speed, unit);
    Lanes by_press = fused(fused(variables[0], DEEPEST[2], DEEPEST[1]), variables[0], DEEPEST[0]);
    Lanes deepest = speed * unit * fused(variables[1], DEEPER_BY_CHANGE, by_press);
    Mask inside = Mask::of(lanes) & (Lanes(0.0) < speed);
    for (int k = 0; k < VARIABLES; k++) {
      variables[k] = (variables[k] - fit.middle[k]) * (1.0 / fit.half[k]);
      inside = inside & (magnitude(variables[k]) < 1.0);
    }
    evaluate(values, variables, fit.coefficients);
    Lanes length = unit * values[0];
    inside = inside & (length * frequency < LONGEST_PART) & ~(Mask::of(last) & (left < length));
    if (observed != 0) see_collisions(inside, side, deepest, length);
    kick_modes(inside, 0.5 * length, unit, side * speed, values);
    LanePhasor end = pass(inside, length);
    if (observed != 0) add_impulses(inside, 0.5 * length, unit, tables.pair * side * speed, end, values);
    return lanes & ~inside.bits();
  }

  // Computes the variables of the polynomials: acceleration at the collision's middle, its derivatives, and
  // u, in units of the collision. `scale` is side / speed, which normalises the rate of p to 1.
  INLINE void fill_variables(Lanes (&variables)[VARIABLES], Lanes scale, Lanes unit) const {
    for (int k = 0; k < DERIVATIVES; k++) variables[k] = 0.0;
    variables[DERIVATIVES] = unit;
    for (int order = 2; order <= HIGHEST; order++) {
      Lanes value = 0.0;
      for (int j = 0; j < FLYING; j++) value = with_real_of_product(value, term[j], series[order][j]);
      scale = scale * unit;
      value = value * scale * (1.0 / INVERSE_FACTORIALS.of[order]);
      double away = 1.0;  // COLLISION_MIDDLE^n / n! for the derivative of an order lower by n
      for (int k = order - 2; k >= 0; k--) {
        if (k < DERIVATIVES) variables[k] = fused(value, away, variables[k]);
        away *= COLLISION_MIDDLE / (order - 1 - k);
      }
    }
  }

  // Returns the integral of F exp(rate (T / 2 - t)) dt over a collision of duration T, divided by the
  // impulse `pair` times the approach speed.
  static INLINE LanePhasor weighted_force(const LanePhasor &rate, Lanes unit, const Lanes (&values)[POLYNOMIALS]) {
    LanePhasor turn{rate.re * unit, rate.im * unit}, sum{(1.0 / (MOMENTS - 1)) * values[MOMENTS], 0.0};
    for (int m = MOMENTS - 2; m >= 0; m--) {
      sum = {fused(sum.re, turn.re, fused(-sum.im, turn.im, values[1 + m])),
             fused(sum.re, turn.im, sum.im * turn.re)};
      if (m > 1) sum = {(1.0 / m) * sum.re, (1.0 / m) * sum.im};
    }
    return sum;
  }

  // Advances the modes by half a collision, adds its impulse, and advances them by the other half.
  INLINE void kick_modes(Mask of, Lanes half, Lanes unit, Lanes push, const Lanes (&values)[POLYNOMIALS]) {
    for (int j = 0; j < DRIVEN; j++) {
      LanePhasor by = grown_by_series<SHORT>(rate[j], half), sum = weighted_force(rate[j], unit, values);
      LanePhasor pushed = fused_product(sum, {push * kick[j].re, push * kick[j].im});
      LanePhasor middle = fused_product(term[j], by);
      middle = {middle.re + pushed.re, middle.im + pushed.im};
      term[j] = select(of, fused_product(middle, by), term[j]);
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
    line = fused_product(line, {end.re, -end.im});
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
      over = keep_due(observed ? march<true>(enough) : march<false>(enough));
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
    for_each_lane(collide(touched, last), [&](int lane) {
      SlowContact ends = contact_alone(lane);
      if (ends == SlowContact::LOST) lose(lane);
      if (ends != SlowContact::LEFT) over |= 1u << lane;
    });
    touched &= ~over;
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
