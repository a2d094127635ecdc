// Motion under a power law, whose force acts at every p, in long steps (decision 0026). In a step the force F
// is a polynomial through its values at eight Gauss points, and the motion is linear in F and in the motion
// at the start (Hairer, Lubich and Wanner, Geometric Numerical Integration, 2nd ed. 2006, section II.1.3). F
// determines p at the points, and p determines F: fixed-point iteration converges like a cosine series.
#pragma once
#include "observe.hpp"

namespace vibench {

constexpr int GAUSS = 8;             // number of Gauss points in a step
constexpr int ORDER = 32;            // number of series terms; the next is at most 1e-20 of the largest term
constexpr int LEVELS = 40;           // number of step lengths, usually with the ratio sqrt(2)
constexpr int INSTANTS = GAUSS + 2;  // instants of an observed step: its start, its Gauss points, its end
constexpr double LONGEST_POWER_TURN = 3.0;  // longest step times the fastest rate [rad]
constexpr int FIRST_LEVEL = 8;       // level of the first step: a sixteenth of the longest step
constexpr double FIT = 1e4;  // allowed misfit of F's polynomial at a step's ends, in tolerances; a
                             // misfit is its relative effect on the motion. The error of the step is smaller
constexpr double CLOSE_FORCE = 1e-2, CLOSEST_FORCE = 1e-14;  // iteration ends at a relative change below this
                                                             // part of the tolerance, or below this value
constexpr int MOST_SUBSTITUTIONS = 30;
constexpr double TRY_LONGER = 0.015;  // below this part of the allowed misfit, the next step is longer
constexpr double FAR_TOO_LONG = 20.0;  // above this multiple of the allowed misfit, the step is halved
constexpr double WALL_TURN = 5.0;  // longest step times the rate of the stiffest spring [rad]
constexpr double FADING = 0.98;    // decay factor per step of the recorded sizes of a motion
constexpr double SMALLEST_PART = 1e-3;  // each displacement counts as at least this part of the largest one
constexpr double NOTHING_MOVES = 1e-150;
constexpr double FINEST_FIT = 1e-10;  // smallest tolerance; a finer fit to a steep wall is lost in rounding

INLINE double fit_tolerance(double tolerance, const Specimen &s) {
  return larger(step_tolerance(tolerance, s), smaller(tolerance, FINEST_FIT));
}

// ---- The law: F = sum force_i (p / reference)^exponent_i, by Horner's scheme in (p / reference)^2.

struct PowerForce {
  double inverse_reference;  // [1/m]
  int terms;
  int halves[MOST_POWERS];   // half the differences of successive exponents, starting from exponent 1
  double forces[MOST_POWERS];  // force of each term at the reference [N]
  int highest;               // highest exponent

  // Returns `base` to the power of `exponent`, which is at least 1.
  template <class T> static INLINE T whole_power(T base, int exponent) {
    while (!(exponent & 1)) base = base * base, exponent >>= 1;
    T result = base;
    while (exponent >>= 1) {
      base = base * base;
      if (exponent & 1) result = result * base;
    }
    return result;
  }
  template <class T> INLINE T operator()(const T &p) const {
    T u = inverse_reference * p, square = u * u;
    T force = forces[terms - 1] * whole_power(square, halves[terms - 1]);
    for (int i = terms - 2; i >= 0; i--) force = (force + forces[i]) * whole_power(square, halves[i]);
    return force * u;
  }
  // Returns dF/dp [N/m].
  double slope(double p) const {
    double u = p * inverse_reference, square = u * u, grown = 1.0, sum = 0.0;
    for (int i = 0, exponent = 1; i < terms; i++) {
      grown *= whole_power(square, halves[i]);
      exponent += 2 * halves[i];
      sum += exponent * forces[i] * grown;
    }
    return sum * inverse_reference;
  }
  // Returns the angular rate of a mass on k1 (`linear`) and on a bound of the law's stiffness at `p` [rad/s].
  double stiffest_rate(double p, double linear, double inverse_mass) const {
    double secant = p > 0.0 ? (*this)(p) / p : 0.0;
    return square_root((linear + highest * secant) * inverse_mass);
  }
};

INLINE PowerForce power_force(const PowerTerms &law) {
  PowerForce force{1.0 / law.reference, int(law.terms), {}, {}, 1};
  for (int i = 0; i < force.terms; i++) {
    force.halves[i] = (int(law.exponents[i]) - force.highest) / 2;
    force.forces[i] = law.forces[i];
    force.highest = int(law.exponents[i]);
  }
  return force;
}

// ---- Coefficients of a step of given length

// One coordinate at the points, in response to a unit of each coordinate at the start, or of F at a point.
struct AtPoints {
  double free[WIDE][GAUSS], gain[GAUSS][GAUSS];
};
struct StepNumbers {
  double length;                      // length of the step [s]
  double move[WIDE][WIDE], feed[GAUSS][WIDE];  // change of the motion per motion at the start, and per F
  AtPoints p, x, p_rate, x_rate;      // the last three only for observation
  double cosine[GAUSS], sine[GAUSS];  // rotation of the drive phasor from the start to the points
};

// Taylor series of exp(A t) for the eight components of a motion: accurate in short steps, without modes.
struct PowerTables {
  const PowerShapes *shapes;
  PowerForce force;
  double fastest;  // fastest rate [1/s]
  double powers[ORDER][WIDE][WIDE], struck[ORDER][WIDE];
  double heights[ORDER][GAUSS];  // powers points^m of the Gauss points
  StepNumbers levels[LEVELS];
};

INLINE void add_row(double (&to)[GAUSS], double factor, const double (&row)[GAUSS]) {
  for (int i = 0; i < GAUSS; i++) to[i] += factor * row[i];
}

inline void fill_points(AtPoints &of, int number, double length, const PowerTables &t, int order = ORDER) {
  of = {};
  double factor = 1.0;
  for (int m = 0; m < order; m++) {
    for (int j = 0; j < WIDE; j++) add_row(of.free[j], factor * t.powers[m][j][number], t.heights[m]);
    for (int k = 0; k < GAUSS; k++)
      add_row(of.gain[k], t.struck[m][number] * factor * length, t.shapes->shares[m][k]);
    factor *= t.fastest * length;
  }
}

inline void fill_step(StepNumbers &numbers, double length, const PowerTables &t, int order = ORDER) {
  numbers = {};
  numbers.length = length;
  double factor = 1.0;
  for (int m = 0; m < order; m++) {
    for (int j = 0; j < WIDE && m > 0; j++) add_row(numbers.move[j], factor, t.powers[m][j]);
    for (int k = 0; k < GAUSS; k++) add_row(numbers.feed[k], factor * length * t.shapes->ends[m][k], t.struck[m]);
    factor *= t.fastest * length;
  }
  fill_points(numbers.p, P, length, t, order);
}

inline void fill_observed(StepNumbers &numbers, double omega, const PowerTables &t) {
  fill_points(numbers.x, AT_X, numbers.length, t);
  fill_points(numbers.p_rate, P_RATE, numbers.length, t);
  fill_points(numbers.x_rate, X_RATE, numbers.length, t);
  for (int i = 0; i < GAUSS; i++) {
    Phasor turn = turned_by(omega * numbers.length * t.shapes->points[i]);
    numbers.cosine[i] = turn.re, numbers.sine[i] = turn.im;
  }
}

// Fills the levels: the first has steps of `longest` [s]; each further level multiplies them by `ratio`.
inline void fill_power_steps(PowerTables &t, const PowerShapes *shapes, const PowerTerms &law, const Specimen &specimen,
                             const Drive &drive, double fastest, double longest, double ratio) {
  t.shapes = shapes;
  t.force = power_force(law);
  t.fastest = fastest;
  fill_series(t.powers, t.struck, t.fastest, specimen, drive);
  for (int i = 0; i < GAUSS; i++) {
    t.heights[0][i] = 1.0;
    for (int m = 1; m < ORDER; m++) t.heights[m][i] = t.heights[m - 1][i] * t.shapes->points[i];
  }
  for (StepNumbers &level : t.levels) {
    fill_step(level, longest, t);
    longest *= ratio;
  }
}

inline void fill_power_tables(PowerTables &t, const Scene &scene, const LinearTables &flight, double omega) {
  double fastest = LONGEST_TURN / flight.grid;
  fill_power_steps(t, scene.power_shapes, scene.power, scene.specimen, scene.drive, fastest,
                   LONGEST_POWER_TURN / fastest, 0.70710678118654752440);
  for (StepNumbers &level : t.levels) fill_observed(level, omega, t);
}

// ---- One step

// Iterates F at the points. `weight` is the change of p per force [m/N], `close` a negligible distance [m].
inline bool substitute(Vector<GAUSS> &pushes, Vector<GAUSS> &places, const PowerForce &law,
                       const double (&gain)[GAUSS][GAUSS], const Vector<GAUSS> &free, double weight, double close) {
  for (int n = 0; n < MOST_SUBSTITUTIONS; n++) {
    places = free + times(gain, pushes);
    Vector<GAUSS> fresh = law(places), off = fresh - pushes;
    pushes = fresh;
    if (!is_finite(total(off))) return false;
    if (weight * largest(magnitude(off)) <= close) return true;
  }
  return false;
}

template <class T> struct PowerStep {
  const Body &t;
  const PowerTables &of;
  double tolerance;
  Wide<T, WIDE> motion, ahead;  // motion at the start and at the end of the step
  Wide<T, GAUSS> force, place;  // F and p at the points
  Vector<GAUSS> course;         // polynomial of F in the last step, in powers of (s - 1)
  double sizes[3];              // recent magnitudes of p, x, z [m]
  double push, push_ahead;      // F at the start and the end [N]
  double last_length = 0.0;     // length of the last step [s]; 0 before the first
  double fading = FADING;

  // Motion without F: p at the points, and the complete motion at the end.
  struct Unforced {
    Vector<GAUSS> places;
    Vector<WIDE> end;
  };
  Unforced unforced(const StepNumbers &numbers) const {
    Vector<WIDE> begin = value_of(motion);
    return {times(numbers.p.free, begin), begin + times(numbers.move, begin)};
  }

  // Conversion from and to `Motion`, in which the drive's phasor is not included.
  void begin_at(const Motion<T> &m) {
    const T numbers[WIDE] = {m.at[Y] - m.at[Z],   m.at[X],  m.at[Z],           m.at[VY] - m.at[VZ],
                             m.at[VX], m.at[VZ], constant<T>(0.0), constant<T>(0.0)};
    motion = gathered(numbers);
    push = of.force(value_of(numbers[P]));
    for (int i = 0; i < 3; i++) sizes[i] = m.powers.sizes[i];
  }
  void write_to(Motion<T> &m) const {
    m.at[X] = at(motion, AT_X), m.at[Z] = at(motion, AT_Z), m.at[Y] = m.at[Z] + at(motion, P);
    m.at[VX] = at(motion, X_RATE), m.at[VZ] = at(motion, Z_RATE), m.at[VY] = m.at[VZ] + at(motion, P_RATE);
  }

  // Tries a step and fills `ahead`; returns its misfit divided by the allowed misfit.
  double attempt(const StepNumbers &numbers, const Unforced &free) {
    Vector<WIDE> begin = value_of(motion);
    double weight = numbers.length * numbers.length * t.inverse_pair;
    double close = largest_unseen(begin, free.end) * larger(CLOSE_FORCE * tolerance, CLOSEST_FORCE);
    Vector<GAUSS> pushes = guessed_force(numbers.length), places;
    if (!substitute(pushes, places, of.force, numbers.p.gain, free.places, weight, close)) return INFINITE;
    Vector<WIDE> now = free.end + times(numbers.feed, pushes);
    push_ahead = of.force(now[P]);
    double before = total(Vector<GAUSS>::load(of.shapes->at_start) * pushes) - push;
    double after = total(Vector<GAUSS>::load(of.shapes->at_end) * pushes) - push_ahead;
    if constexpr (is_dual<T>) force.value = pushes, place.value = places, ahead.value = now;
    else force = pushes, place = places, ahead = now;
    return weight * larger(magnitude(before), magnitude(after)) / (FIT * tolerance * largest_unseen(begin, now));
  }

  // Computes the derivatives of the trial step. With the law's slopes D, a change dp at the points satisfies
  // (1 - gain D) dp = free du. The change of the motion follows from D dp as the motion does from F.
  void differentiate(const StepNumbers &numbers) {
    if constexpr (is_dual<T>) {
      constexpr int M = int(sizeof motion.slope / sizeof motion.slope[0]);
      double equations[GAUSS][GAUSS + M], slopes[GAUSS];
      for (int k = 0; k < GAUSS; k++) {
        slopes[k] = of.force.slope(place.value[k]);
        for (int i = 0; i < GAUSS; i++) equations[i][k] = (i == k) - numbers.p.gain[k][i] * slopes[k];
      }
      for (int c = 0; c < M; c++) {
        Vector<GAUSS> free = times(numbers.p.free, motion.slope[c]);
        for (int i = 0; i < GAUSS; i++) equations[i][GAUSS + c] = free[i];
      }
      eliminate(equations);
      for (int c = 0; c < M; c++) {
        for (int k = 0; k < GAUSS; k++) force.slope[c].set(k, slopes[k] * equations[k][GAUSS + c]);
        ahead.slope[c] = motion.slope[c] + times(numbers.move, motion.slope[c]) + times(numbers.feed, force.slope[c]);
      }
    }
  }

  void accept(const StepNumbers &numbers) {
    Vector<WIDE> begin = value_of(motion), end = value_of(ahead);
    constexpr int PLACES[3] = {P, AT_X, AT_Z};
    for (int i = 0; i < 3; i++)
      sizes[i] = larger(fading * sizes[i], larger(magnitude(begin[PLACES[i]]), magnitude(end[PLACES[i]])));
    course = push_ahead * Vector<GAUSS>::load(of.shapes->course[GAUSS]);
    Vector<GAUSS> pushes = value_of(force);
    for (int k = 0; k < GAUSS; k++) course = course + pushes[k] * Vector<GAUSS>::load(of.shapes->course[k]);
    last_length = numbers.length;
    push = push_ahead;
    motion = ahead;
  }

  // Returns the first level, from `level` on, with steps short enough for the stiff wall; LEVELS if none.
  int level_that_sees(int level) const {
    Vector<WIDE> now = value_of(motion);
    double p = now[P], outward = larger(p >= 0.0 ? now[P_RATE] : -now[P_RATE], 0.0);
    for (; level < LEVELS; level++) {
      double length = of.levels[level].length, reach = magnitude(p) + outward * length;
      if (length * of.force.stiffest_rate(reach, t.specimen.k1, t.inverse_pair) <= WALL_TURN) break;
    }
    return level;
  }

 private:
  static constexpr int COURSE_DEGREE = 5;

  Vector<GAUSS> guessed_force(double length) const {
    if (last_length == 0.0) return Vector<GAUSS>(push);
    Vector<GAUSS> s = (length / last_length) * Vector<GAUSS>::load(of.shapes->points);
    Vector<GAUSS> sum(course[COURSE_DEGREE]);
    for (int degree = COURSE_DEGREE - 1; degree >= 0; degree--) sum = sum * s + course[degree];
    return sum;
  }

  // Returns the reference size for errors: the smallest recent magnitude of p, x and z, up to the step's end.
  double largest_unseen(const Vector<WIDE> &begin, const Vector<WIDE> &end) const {
    double p = larger(sizes[0], larger(magnitude(begin[P]), magnitude(end[P])));
    double x = larger(sizes[1], larger(magnitude(begin[AT_X]), magnitude(end[AT_X])));
    double z = larger(sizes[2], larger(magnitude(begin[AT_Z]), magnitude(end[AT_Z])));
    return larger(smaller(p, smaller(x, z)), SMALLEST_PART * larger(p, larger(x, z))) + NOTHING_MOVES;
  }

  // Gaussian elimination with pivoting; columns to the right of the square matrix are right-hand sides.
  template <int N> static void eliminate(double (&rows)[GAUSS][N]) {
    for (int k = 0; k < GAUSS; k++) {
      int pivot = k;
      for (int i = k + 1; i < GAUSS; i++)
        if (magnitude(rows[i][k]) > magnitude(rows[pivot][k])) pivot = i;
      for (int j = k; j < N; j++) {
        double swapped = rows[k][j];
        rows[k][j] = rows[pivot][j], rows[pivot][j] = swapped;
      }
      double inverse = 1.0 / rows[k][k];
      for (int j = k; j < N; j++) rows[k][j] *= inverse;
      for (int i = 0; i < GAUSS; i++) {
        double factor = rows[i][k];
        if (i == k || factor == 0.0) continue;
        for (int j = k; j < N; j++) rows[i][j] -= factor * rows[k][j];
      }
    }
  }
};

INLINE int level_after(int level, double misfit) {
  if (!(misfit <= 1.0)) return misfit < FAR_TOO_LONG ? level + 1 : level + 2;
  return misfit < TRY_LONGER && level > 0 ? level - 1 : level;
}

// ---- Observation of a step

// One displacement and its rate at ten instants of a step. The polynomial of degree 19 through these values
// is exact to rounding. Barycentric formulas: Berrut and Trefethen, SIAM Rev. 46 (2004) 501.
struct StepCourse {
  double value[INSTANTS], rate[INSTANTS];
  double length;
  const PowerShapes &shapes;

  double rate_at(double s) const {
    double sum = 0.0, norm = 0.0;
    for (int i = 0; i < INSTANTS; i++) {
      if (s == shapes.instants[i]) return rate[i];
      double part = shapes.instant_weights[i] / (s - shapes.instants[i]);
      norm += part;
      sum += part * rate[i];
    }
    return sum / norm;
  }
  double value_at(double s) const {
    double sum = 0.0, norm = 0.0;
    for (int i = 0; i < INSTANTS; i++) {
      double off = s - shapes.instants[i];
      if (off == 0.0) return value[i];
      double part = shapes.instant_weights[i] / off;
      double slope = length * rate[i] - 2.0 * shapes.instant_slopes[i] * value[i];
      norm += part;
      sum += part * part * (value[i] + off * slope);
    }
    return sum / (norm * norm);
  }
  double peak(double best) const {
    constexpr int SECANTS_IN_STEP = 6;  // number of secants, after which the error of a peak is negligible
    for (double each : value) best = larger(best, magnitude(each));
    for (int i = 0; i + 1 < INSTANTS; i++) {
      double low = shapes.instants[i], high = shapes.instants[i + 1], rate_low = rate[i], rate_high = rate[i + 1];
      if (!may_peak(best, {value[i], rate_low}, {value[i + 1], rate_high}, (high - low) * length)) continue;
      double s = low;
      for (int n = 0; n < SECANTS_IN_STEP && rate_low != rate_high; n++) {
        s = low - rate_low * (high - low) / (rate_high - rate_low);
        double now = rate_at(s);
        if (now * rate_low > 0.0) low = s, rate_low = now;
        else high = s, rate_high = now;
      }
      best = larger(best, magnitude(value_at(s)));
    }
    return best;
  }
};

// ---- A run

template <class T> class PowerRun {
 public:
  PowerRun(Motion<T> &motion, const Tables &tables, double tolerance, Record &record)
      : m(motion), t(tables), of(*tables.power), tolerance(tolerance), record(record), observer{record, tables} {}

  Outcome advance(double until) { return observed(observer, m, t, [&] { return go_on(until); }); }

 private:
  Motion<T> &m;
  const Tables &t;
  const PowerTables &of;
  double tolerance;
  Record &record;
  Observer observer;

  Outcome go_on(double until) {
    PowerStep<T> step{t, of, fit_tolerance(tolerance, t.specimen), {}, {}, {}, {}, {}, {}, 0.0, 0.0, 0.0};
    int level = m.powers.level > 0.0 ? int(m.powers.level) - 1 : FIRST_LEVEL;
    begin(step);
    Outcome outcome = REACHED_END;
    for (double left; (left = value_of(time_until(m.clock, until))) > 0.0;) {
      if (record.steps_left <= 0) {
        outcome = TOO_LONG;
        break;
      }
      record.steps_left -= RESOLVED_STEP;
      level = step.level_that_sees(level);
      if (level >= LEVELS) {
        outcome = is_finite(total(value_of(step.motion))) ? STALLED : NOT_FINITE;
        break;
      }
      bool is_last = left <= of.levels[level].length;
      StepNumbers last;
      if (is_last) fill_step(last, left, of);
      const StepNumbers &numbers = is_last ? last : of.levels[level];
      double misfit = step.attempt(numbers, step.unforced(numbers));
      if (!(misfit <= 1.0)) {
        level = level_after(level, misfit);
        continue;
      }
      if (observer.is_on()) {
        if (is_last) fill_observed(last, t.omega, of);
        see(step, numbers);
      }
      keep_samples(record, {m.clock.high, m.clock.low, 0.0}, numbers.length, [&](double later, double *sample) {
        if (later > 0.0) place_within(step, numbers.length, later, sample);
        else write_motion(sample, value_of(step.motion));
      });
      step.differentiate(numbers);
      step.accept(numbers);
      if (is_last) m.clock = {until, 0.0, constant<T>(0.0)};
      else {
        vibench::advance(m.clock, constant<T>(numbers.length));
        level = level_after(level, misfit);
      }
      set_drive(step);
      if constexpr (is_dual<T>) rescale(step);
    }
    step.write_to(m);
    m.powers.level = 1.0 + (level < LEVELS ? level : LEVELS - 1);
    for (int i = 0; i < 3; i++) m.powers.sizes[i] = step.sizes[i];
    return outcome;
  }

  void begin(PowerStep<T> &step) const {
    step.begin_at(m);
    set_drive(step);
  }
  static void write_motion(double *motion, const Vector<WIDE> &u) {
    motion[X] = u[AT_X], motion[Z] = u[AT_Z], motion[Y] = u[AT_Z] + u[P];
    motion[VX] = u[X_RATE], motion[VZ] = u[Z_RATE], motion[VY] = u[Z_RATE] + u[P_RATE];
  }

  void set_drive(PowerStep<T> &step) const {
    Phasor now = drive_phasor(Clock<double>{m.clock.high, m.clock.low, 0.0}, 0.0, t);
    if constexpr (is_dual<T>) step.motion.value.set(COSINE, now.re), step.motion.value.set(SINE, now.im);
    else step.motion.set(COSINE, now.re), step.motion.set(SINE, now.im);
  }

  // Keeps the derivatives in range, as `Run` does for the other laws.
  void rescale(PowerStep<T> &step) {
    step.write_to(m);
    if (!keep_in_range(m)) return;
    double push = step.push, sizes[3] = {step.sizes[0], step.sizes[1], step.sizes[2]};
    Vector<WIDE> values = value_of(step.motion);
    begin(step);
    step.motion.value = values, step.push = push;
    for (int i = 0; i < 3; i++) step.sizes[i] = sizes[i];
  }

  void see(const PowerStep<T> &step, const StepNumbers &numbers) {
    Vector<WIDE> first = value_of(step.motion), last = value_of(step.ahead);
    Vector<GAUSS> force = value_of(step.force);
    auto fill = [&](double (&row)[INSTANTS], const AtPoints &of, int number) {
      Vector<GAUSS> inside = times(of.free, first) + times(of.gain, force);
      row[0] = first[number], row[INSTANTS - 1] = last[number];
      for (int i = 0; i < GAUSS; i++) row[i + 1] = inside[i];
    };
    StepCourse x{{}, {}, numbers.length, *of.shapes}, p{{}, {}, numbers.length, *of.shapes};
    fill(x.value, numbers.x, AT_X), fill(x.rate, numbers.x_rate, X_RATE);
    fill(p.value, numbers.p, P), fill(p.rate, numbers.p_rate, P_RATE);
    record.peak_x = x.peak(record.peak_x), record.peak_p = p.peak(record.peak_p);
    if (!observer.wants_lines()) return;
    Vector<GAUSS> weighted = numbers.length * (Vector<GAUSS>::load(of.shapes->weights) * force);
    Phasor push{total(weighted * Vector<GAUSS>::load(numbers.cosine)),
                -total(weighted * Vector<GAUSS>::load(numbers.sine))};
    observer.impulse = observer.impulse + push * Phasor{first[COSINE], -first[SINE]};
  }

  // Computes a sample as the end of a shorter step. Its force is interpolated from the step and refined once.
  void place_within(const PowerStep<T> &step, double length, double later, double *sample) const {
    StepNumbers part;
    fill_step(part, later, of);
    Vector<GAUSS> known = value_of(step.force), guess;
    Vector<WIDE> begin = value_of(step.motion);
    double ratio = later / length;
    for (int i = 0; i < GAUSS; i++) {
      double s = ratio * of.shapes->points[i], sum = 0.0, norm = 0.0;
      for (int k = 0; k < GAUSS; k++) {
        double off = s - of.shapes->points[k];
        if (off == 0.0) {
          sum = known[k], norm = 1.0;
          break;
        }
        norm += of.shapes->point_weights[k] / off;
        sum += of.shapes->point_weights[k] / off * known[k];
      }
      guess.set(i, sum / norm);
    }
    Vector<GAUSS> force = of.force(times(part.p.free, begin) + times(part.p.gain, guess));
    write_motion(sample, begin + times(part.move, begin) + times(part.feed, force));
  }
};

}  // namespace vibench
