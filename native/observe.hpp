// Observation of a run without storing the motion: peaks of x and p, and their spectral lines at the drive
// frequency. It uses only values, not derivatives, and never changes a step.
#pragma once
#include "collision.hpp"
#include "contact.hpp"

namespace vibench {

// State of a motion between two steps of a run, and the record of the run.

// State of a run under a power law between its steps.
struct PowerMemory {
  double level;     // level of the next step plus one; 0 before the first step
  double sizes[3];  // recent magnitudes of p, x, z [m]
};

template <class T> struct Motion {
  T at[6];  // x, y, z, vx, vy, vz [m, m/s]
  Clock<T> clock;
  Contact<T> contact;
  PowerMemory powers;
  double growth[6];  // logarithm of the factor removed from each derivative
};

inline Motion<double> motion_of(const State &state) {
  Motion<double> motion;
  __builtin_memcpy(motion.at, state.motion, sizeof motion.at);
  motion.clock = {state.clock_high, state.clock_low, 0.0};
  motion.contact = {state.root,       state.rate,       state.side, state.step,
                    state.root_scale, state.rate_scale, state.pace};
  motion.powers.level = state.level;
  __builtin_memcpy(motion.powers.sizes, state.sizes, sizeof state.sizes);
  for (double &growth : motion.growth) growth = 0.0;
  return motion;
}

inline void keep(State &state, const Motion<double> &motion) {
  __builtin_memcpy(state.motion, motion.at, sizeof motion.at);
  state.clock_high = motion.clock.high, state.clock_low = motion.clock.low;
  const Contact<double> &c = motion.contact;
  state.root = c.w, state.rate = c.r, state.side = c.side, state.step = c.step;
  state.root_scale = c.root_scale, state.rate_scale = c.rate_scale, state.pace = c.pace;
  state.level = motion.powers.level;
  __builtin_memcpy(state.sizes, motion.powers.sizes, sizeof state.sizes);
}

INLINE Motion<double> values_of(const Motion<double> &motion) { return motion; }
template <int M> inline Motion<double> values_of(const Motion<Dual<double, M>> &motion) {
  const auto &c = motion.contact;
  Motion<double> values{{}, {motion.clock.high, motion.clock.low, 0.0}, {}, motion.powers, {}};
  for (int i = 0; i < 6; i++) values.at[i] = motion.at[i].value;
  values.contact = {c.w.value, c.r.value, c.side, c.step, c.root_scale, c.rate_scale, c.pace};
  return values;
}

// Normalises very large or small derivatives, so that products with physical quantities stay finite. Adds the
// logarithm of each removed factor to `growth`. Returns whether a derivative changed.
template <int M> inline bool keep_in_range(Motion<Dual<double, M>> &motion) {
  constexpr double LARGEST = 1e100, SMALLEST = 1e-100;
  bool is_changed = false;
  for (int k = 0; k < M; k++) {
    double size = 0.0;
    for (const auto &number : motion.at) size = larger(size, magnitude(number.slope[k]));
    if (!(size > LARGEST || (size < SMALLEST && size > 0.0)) || !is_finite(size)) continue;
    for (auto &number : motion.at) number.slope[k] /= size;
    motion.contact.w.slope[k] /= size, motion.contact.r.slope[k] /= size, motion.clock.slip.slope[k] /= size;
    motion.growth[k] += logarithm(size);
    is_changed = true;
  }
  return is_changed;
}

constexpr int64_t MOST_STEPS = 2000000000;  // largest number of grid steps of flight in a run
constexpr int64_t RESOLVED_STEP = 50;       // computing time of a contact step, in units of a grid step

// Returns the number of grid steps of a flight; MOST_STEPS if its length or its grid is not finite.
INLINE int64_t steps_of(double length, double grid) {
  double steps = length / grid;
  return steps >= 0.0 && steps < double(MOST_STEPS) ? 1 + int64_t(steps) : MOST_STEPS;
}

// Counts an impact, and stores its time if requested. Returns false if the number of impacts is at its limit.
INLINE bool keep_impact(Record &record, double time) {
  if (record.impacts == record.impact_room) return false;
  if (record.impact_times != nullptr) record.impact_times[record.impacts] = time;
  record.impacts++;
  return true;
}

// Stores the samples of the next `length` seconds. `place_sample(later, sample)` computes one sample.
template <class PlaceSample>
inline void keep_samples(Record &record, const Clock<double> &clock, double length, const PlaceSample &place_sample) {
  while (record.samples_kept < record.sample_room) {
    double later = time_until(clock, record.start + double(record.samples_kept) / record.sample_rate);
    if (later > length) return;
    place_sample(later, record.samples + 6 * record.samples_kept);
    record.samples_kept++;
  }
}

constexpr int SECANTS = 4;            // secant iterations to an extreme; its value is then exact to rounding
constexpr int APEX_SECANTS = 6;       // secant iterations to the deepest point of a contact in time steps
constexpr double SMALL_EXPONENT = 1e-3;  // for smaller q, (exp(q) - 1) / q is a series of four terms
constexpr double ABOVE_POINTS = 1.03;  // bound of the largest depth, divided by the largest depth at the points

// ---- Extremes

// Returns the largest magnitude of a polynomial with at most one extreme on [low, high]; at least `best`.
inline double series_peak(double best, const double *series, double low, double high) {
  ValueAndRate first = polynomial_at(series, low), last = polynomial_at(series, high);
  best = larger(best, larger(magnitude(first.value), magnitude(last.value)));
  for (int n = 0; n < SECANTS && first.rate * last.rate < 0.0; n++) {
    double tau = low - first.rate * (high - low) / (last.rate - first.rate);
    ValueAndRate now = polynomial_at(series, tau);
    best = larger(best, magnitude(now.value));
    if (now.rate * first.rate > 0.0) low = tau, first = now;
    else high = tau, last = now;
  }
  return best;
}

// Like `series_peak`, for the cubic with the given values and rates at both ends of a step.
inline double cubic_peak(double best, const ValueAndRate &first, const ValueAndRate &last, double step) {
  double rise = (last.value - first.value) / step;
  double series[AHEAD] = {first.value, first.rate, (3.0 * rise - 2.0 * first.rate - last.rate) / step,
                          (first.rate + last.rate - 2.0 * rise) / (step * step)};
  if (first.rate * last.rate < 0.0) return series_peak(best, series, 0.0, step);
  return larger(best, larger(magnitude(first.value), magnitude(last.value)));
}

// Returns whether an extreme in a step may exceed `best`. The motion stays below the tangents at both ends.
INLINE bool may_peak(double best, const ValueAndRate &first, const ValueAndRate &last, double step) {
  double above = smaller(magnitude(first.value) + step * magnitude(first.rate),
                         magnitude(last.value) + step * magnitude(last.rate));
  return first.rate * last.rate < 0.0 && above > best;
}

template <int N> INLINE ValueAndRate value_and_rate(const PhasorSum<N> &sum) {
  double rate = 0.0;
  for (int j = 0; j < N && j <= sum.tables.modes; j++) rate += real_of_product(sum.terms[j], sum.tables.rates[j]);
  return {sum.now(), rate};
}

// Returns the largest magnitude of a displacement in a linear motion over `length` seconds; at least `best`.
// Only grid steps with a bound above `best` are examined. An extreme is sought if the rate changes sign.
template <int N>
inline double linear_peak(double best, const Phasor *shape, const Phasor *phasors, const Clock<double> &clock,
                          double length, const LinearTables &t, const Tables &tables) {
  double h = t.grid, done = 0.0, series[AHEAD];
  Phasor now[PHASORS];
  for (;;) {
    if (done > 0.0) propagate(now, phasors, done, drive_phasor(clock, done, tables), t);
    else __builtin_memcpy(now, phasors, (t.modes + 1) * sizeof(Phasor));
    PhasorSum<N> sum(now, shape, t);
    if (sum.reach <= best) return best;
    double excess = sum.bound * h * h / 8.0;
    int steps = whole_steps(length - done, h, RUN_OF_STEPS);
    for (int made = 0; made < steps;) {
      if (magnitude(sum.now()) + excess <= best) {
        made += sum.march(steps - made, excess - best, best - excess);
        if (made == steps) break;
      }
      PhasorSum<N> before = sum;
      ValueAndRate first = value_and_rate(before);
      sum.turn(1);
      made++;
      ValueAndRate last = value_and_rate(sum);
      best = larger(best, larger(magnitude(first.value), magnitude(last.value)));
      if (may_peak(best, first, last, h)) {
        before.rows(t.series).store(series);
        best = series_peak(best, series, 0.0, h);
      }
    }
    done += steps * h;
    if (steps == RUN_OF_STEPS) continue;
    sum.rows(t.series).store(series);
    ValueAndRate first = value_and_rate(sum), last = polynomial_at(series, length - done);
    best = larger(best, larger(magnitude(first.value), magnitude(last.value)));
    return may_peak(best, first, last, length - done) ? series_peak(best, series, 0.0, length - done) : best;
  }
}

INLINE double peak_of(double best, const Phasor *shape, const Phasor *phasors, const Clock<double> &clock,
                      double length, const LinearTables &t, const Tables &tables) {
  if (t.modes == 3) return linear_peak<4>(best, shape, phasors, clock, length, t, tables);
  return linear_peak<PHASORS>(best, shape, phasors, clock, length, t, tables);
}

// ---- Fourier integrals of the stops' force f on p: integral of f exp(-i (omega t + phase)) dt [N s]

// Returns the integral over `length` of a quantity that grows as exp(rate t) from `first` to `last`.
INLINE Phasor integral(const Phasor &rate, double length, const Phasor &first, const Phasor &last) {
  Phasor exponent = length * rate;
  if (exponent.re * exponent.re + exponent.im * exponent.im < SMALL_EXPONENT * SMALL_EXPONENT) {
    Phasor sum{1.0 / 24.0, 0.0}, one{1.0, 0.0};
    sum = (1.0 / 6.0) * one + exponent * sum;
    sum = 0.5 * one + exponent * sum;
    return length * (first * (one + exponent * sum));
  }
  return quotient(last - first, rate);
}

// Returns the Fourier integral of Re sum weights_j e_j, where each phasor e_j changes from `first` to `last`.
inline Phasor line_of(const Phasor *weights, const Phasor *first, const Phasor *last, double length,
                      const LinearTables &t) {
  Phasor drive = t.rates[t.modes], sum{0.0, 0.0};
  Phasor before = 0.5 * conjugate(first[t.modes]), after = 0.5 * conjugate(last[t.modes]);
  for (int j = 0; j <= t.modes; j++) {
    Phasor against = conjugate(t.rates[j]) - drive;
    sum = sum + weights[j] * integral(t.rates[j] - drive, length, first[j] * before, last[j] * after) +
          conjugate(weights[j]) *
              integral(against, length, conjugate(first[j]) * before, conjugate(last[j]) * after);
  }
  return sum;
}

// ---- Results of the observation

struct Observer {
  Record &record;
  const Tables &t;
  Phasor impulse{0.0, 0.0};  // Fourier integral of the stops' force, positive on the stop at positive p

  bool is_on() const { return record.watch != WATCH_NOTHING; }
  bool wants_lines() const { return record.watch == WATCH_PEAKS_AND_LINES; }

  void see_flight(const Phasor *phasors, const Clock<double> &clock, double length) {
    record.peak_x = peak_of(record.peak_x, t.flight.across, phasors, clock, length, t.flight, t);
    // A flight between the stops cannot exceed a peak that is already at the farther stop.
    if (record.peak_p < larger(t.specimen.lower_gap, t.specimen.upper_gap))
      record.peak_p = peak_of(record.peak_p, t.flight.path, phasors, clock, length, t.flight, t);
  }

  // Observes m1 on a rigid or linear stop. The phasors do not include the constant part of p.
  void see_held(const Phasor *first, const Phasor *last, const Clock<double> &clock, double side, double length) {
    double gap = gap_at(t.specimen, side), rests = t.rests * gap;
    record.peak_x = peak_of(record.peak_x, t.held.across, first, clock, length, t.held, t);
    record.peak_p = larger(record.peak_p, gap);
    if (t.specimen.law == SPRINGS)
      record.peak_p = rests + peak_of(record.peak_p - rests, t.held.path, first, clock, length, t.held, t);
    if (!wants_lines()) return;
    double push = t.specimen.law == SPRINGS ? t.specimen.linear_stiffness : t.pair;  // force per unit pull
    Phasor begun = conjugate(first[t.held.modes]), ended = conjugate(last[t.held.modes]);
    Phasor at_rest = integral({0.0, -t.omega}, length, begun, ended);
    impulse = impulse + push * (line_of(t.pulls, first, last, length, t.held) - (side * t.let_go * gap) * at_rest);
  }

  // Observes an impact on a rigid stop, which changes dp/dt by `jump` [m/s].
  void see_impact(double jump, const Phasor &drive) {
    if (wants_lines()) impulse = impulse - (t.pair * jump) * conjugate(drive);
  }

  // Observes x and p in a complete collision; `course()` returns the Taylor terms of x without contact force.
  template <class Course> void see_shape(const Collision<double> &c, double gap, const Course &course) {
    const CollisionTables &of = t.collision;
    see_x_of(c, course);
    double deepest = c.unit * of.shapes->durations[c.press][DEEPER];
    if (gap + deepest * ABOVE_POINTS * largest(c.depths) > record.peak_p)
      record.peak_p = larger(record.peak_p, gap + deepest * top_of(times(of.shapes->about_middle, c.depths)));
  }

  void see_collision(const Collision<double> &c, double side, const Phasor &drive) {
    const CollisionTables &of = t.collision;
    see_shape(c, gap_at(t.specimen, side), [&] { return times(of.onto_x, c.motion); });
    if (!wants_lines()) return;
    Vector<POINTS> angle = (t.omega * c.duration) * Vector<POINTS>::load(of.shapes->heights), q = angle * angle;
    Vector<POINTS> force = (side * c.duration) * Vector<POINTS>::load(of.shapes->weights) * c.force;
    // Angles are smaller than LONGEST_COLLISION, so these series are accurate to 3e-11.
    Vector<POINTS> cosine = 1.0 + q * (-0.5 + q * (1.0 / 24 + q * (-1.0 / 720 + q * (1.0 / 40320))));
    Vector<POINTS> sine = angle * (1.0 + q * (-1.0 / 6 + q * (1.0 / 120 + q * (-1.0 / 5040 + q * (1.0 / 362880)))));
    impulse = impulse + Phasor{total(force * cosine), -total(force * sine)} * conjugate(drive);
  }

  // Observes an accepted contact step from `steps.point` to `steps.trial`, with the length `h` in s.
  template <class T, class Force>
  void see_step(const ContactSteps<T, Force> &steps, double h, const Contact<T> &c) {
    const auto &from = steps.point, &to = steps.trial;
    ValueAndRate first{value_of(from[CX]), value_of(from[CVX])}, last{value_of(to[CX]), value_of(to[CVX])};
    record.peak_x = cubic_peak(record.peak_x, first, last, value_of(to[TIME]) - value_of(from[TIME]));
    double gap = steps.rates.gap, deepest = larger(value_of(from[W]), value_of(to[W]));
    if (value_of(from[R]) > 0.0 && value_of(to[R]) < 0.0) deepest = larger(deepest, apex_of(steps, h, c.rate_scale));
    record.peak_p = larger(record.peak_p, gap + deepest * deepest);
    if (wants_lines()) impulse = impulse + impulse_of(steps, h);
  }

  // Adds the line integrals of x and p over a stretch. Let s' = A s + b f + drive, u = s - steady motion, and
  // e = exp(-i (omega t + phase)). Then (i omega - A) integral(u e) = b impulse - [u e], from start to end.
  struct End {
    double motion[6];
    Clock<double> clock;
    Phasor drive;
  };
  void add_lines(const End &first, const End &last) {
    if (!wants_lines()) return;
    double length = (last.clock.high - first.clock.high) + (last.clock.low - first.clock.low);
    Phasor begun = conjugate(first.drive), ended = conjugate(last.drive);
    Phasor twice = quotient(begun * begun - ended * ended, {0.0, 4.0 * t.omega});
    Phasor x = impulse * t.lines.struck_x, p = impulse * t.lines.struck_p;
    for (int i = 0; i < 6; i++) {
      const Phasor &steady = t.flight.shapes[t.flight.modes][i];
      Phasor change = (last.motion[i] - real_of_product(last.drive, steady)) * ended -
                      (first.motion[i] - real_of_product(first.drive, steady)) * begun;
      x = x - change * t.lines.across[i], p = p - change * t.lines.path[i];
    }
    const Phasor &steady_x = t.flight.across[t.flight.modes], &steady_p = t.flight.path[t.flight.modes];
    record.line_x = record.line_x + x + (0.5 * length) * steady_x + twice * conjugate(steady_x);
    record.line_p = record.line_p + p + (0.5 * length) * steady_p + twice * conjugate(steady_p);
    impulse = {0.0, 0.0};
  }

 private:
  // Returns the largest value of the Taylor polynomial of the depth about the middle of a collision.
  static double top_of(const Vector<TERMS> &terms) {
    constexpr double FARTHEST_TOP = 0.5;  // within this phi of the middle, eight terms are accurate to 1e-7
    double at = 0.0, value = 0.0;
    for (int n = 0; n < SECANTS; n++) {
      double slope = 0.0, bend = 0.0;
      for (int k = TERMS - 1; k > 0; k--) {
        bend = bend * at + slope;
        slope = slope * at + k * terms[k];
      }
      at = smaller(FARTHEST_TOP, larger(-FARTHEST_TOP, at - slope / bend));
    }
    for (int k = TERMS - 1; k >= 0; k--) value = value * at + terms[k];
    return value;
  }

  // Updates the peak of x in a complete collision, including extremes between the points.
  template <class Course> void see_x_of(const Collision<double> &c, const Course &course_of_x) {
    const CollisionTables &of = t.collision;
    ValueAndRate first{c.motion[AT_X], c.motion[X_RATE]}, last{c.after[AT_X], c.after[X_RATE]};
    record.peak_x = larger(record.peak_x, larger(magnitude(first.value), magnitude(last.value)));
    if (!may_peak(record.peak_x, first, last, c.duration)) return;
    Vector<TERMS> course = course_of_x();
    double turn = of.fastest * c.duration, factor = turn;
    Vector<POINTS> turns = turn * Vector<POINTS>::load(of.shapes->heights);
    // The contact force acts on x only through m2 and damper c2, so terms start with the second integral.
    Vector<POINTS> x = first.value + series_at_points<double>(course, turns) +
                       pushed<double>(c.force, 2, SLOW_TERMS, AT_X, c.duration, of);
    Vector<POINTS> rate(0.0);
    for (int m = TERMS - 1; m > 0; m--) rate = rate * turns + (m * of.fastest * course[m]);
    for (int m = 2; m < SLOW_TERMS; m++) {
      factor *= turn;
      rate = rate + (m * factor * of.struck[m][AT_X]) * times(of.shapes->shares[m - 1], c.force);
    }
    double before = 0.0;
    for (int k = 0; k < POINTS; k++) {
      ValueAndRate next{x[k], rate[k]};
      record.peak_x = cubic_peak(record.peak_x, first, next, c.duration * (of.shapes->heights[k] - before));
      before = of.shapes->heights[k], first = next;
    }
    record.peak_x = cubic_peak(record.peak_x, first, last, c.duration * (1.0 - before));
  }

  // Repeats a contact step up to the deepest point, where r = 0, and returns w at this point.
  template <class T, class Force>
  double apex_of(const ContactSteps<T, Force> &steps, double h, double rate_scale) const {
    const auto &r = steps.rates;
    ContactSteps<double, Force> again{{r.t, r.base, r.force, r.side, r.gap}, steps.tolerance, {}, {}, {}};
    for (int q = 0; q < UNKNOWNS; q++) again.point[q] = value_of(steps.point[q]);
    again.rates(again.point, again.stages[0]);
    double low = 0.0, high = h, before = again.point[R], after = value_of(steps.trial[R]), deepest = 0.0;
    for (int n = 0; n < APEX_SECANTS; n++) {
      double part = low + (high - low) * before / (before - after);
      again.take(part);
      double rate = again.trial[R];
      deepest = larger(deepest, again.trial[W]);
      if (magnitude(rate) < 1e-5 * rate_scale) break;  // w is stationary at r = 0, so its error is quadratic
      if (rate > 0.0) low = part, before = rate;
      else high = part, after = rate;
    }
    return deepest;
  }

  // Returns the Fourier integral of f dt = side F w ds over a step, from the stages of the method.
  template <class T, class Force> Phasor impulse_of(const ContactSteps<T, Force> &steps, double h) const {
    const BaseForce &base = steps.rates.base;
    Phasor sum{0.0, 0.0};
    for (int j = 0; j < STAGES; j++) {
      if (END_WEIGHTS[j] == 0.0) continue;
      double w = value_of(steps.stages[j][TIME]), r = 2.0 * value_of(steps.stages[j][W]), passed = 0.0;
      for (int i = 0; i < j; i++) passed += STAGE_WEIGHTS[j][i] * value_of(steps.stages[i][TIME]);
      double time = value_of(steps.point[TIME]) + h * passed;
      auto [cosine, sine] = cosine_sine_near_zero(t.omega * (time - base.middle), 0.0);
      sum = sum + (END_WEIGHTS[j] * w * steps.rates.force(w, r)) * Phasor{cosine, -sine};
    }
    return (steps.rates.side * h) * (sum * conjugate(base.drive));
  }
};

// Runs `act`, which advances the motion, and adds the line integrals over the elapsed time.
template <class T, class Act>
inline Outcome observed(Observer &observer, const Motion<T> &motion, const Tables &t, const Act &act) {
  if (!observer.wants_lines()) return act();
  auto now = [&] {
    Motion<double> values = values_of(motion);
    Observer::End end{{}, values.clock, drive_phasor(values.clock, 0.0, t)};
    __builtin_memcpy(end.motion, values.at, sizeof end.motion);
    return end;
  };
  Observer::End begin = now();
  Outcome outcome = act();
  observer.add_lines(begin, now());
  return outcome;
}

}  // namespace vibench
