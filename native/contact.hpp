// Contact with a compliant stop, integrated from touch to release in steps with error control (decisions 0004
// and 0008). With |p| = gap + w^2 and dt = w ds, the force of eq. 2 is k w^3, and every derivative is a
// polynomial. This removes the kink of penetration^(3/2), and makes touch and release simple zeros of w.
#pragma once
#include "flight.hpp"

namespace vibench {

// Dormand and Prince's method of order 8(5,3). Coefficients and error estimates are from Hairer, Norsett and
// Wanner, Solving Ordinary Differential Equations I (2nd ed. 1993), section II.10 and the code DOP853.

constexpr int STAGES = 12;

// clang-format off
constexpr double STAGE_WEIGHTS[STAGES][STAGES] = {
    {},
    {0.05260015195876773},
    {0.0197250569845379, 0.0591751709536137},
    {0.02958758547680685, 0.0, 0.08876275643042054},
    {0.2413651341592667, 0.0, -0.8845494793282861, 0.924834003261792},
    {0.037037037037037035, 0.0, 0.0, 0.17082860872947386, 0.12546768756682242},
    {0.037109375, 0.0, 0.0, 0.17025221101954405, 0.06021653898045596, -0.017578125},
    {0.03709200011850479, 0.0, 0.0, 0.17038392571223998, 0.10726203044637328, -0.015319437748624402,
     0.008273789163814023},
    {0.6241109587160757, 0.0, 0.0, -3.3608926294469414, -0.868219346841726, 27.59209969944671,
     20.154067550477894, -43.48988418106996},
    {0.47766253643826434, 0.0, 0.0, -2.4881146199716677, -0.590290826836843, 21.230051448181193,
     15.279233632882423, -33.28821096898486, -0.020331201708508627},
    {-0.9371424300859873, 0.0, 0.0, 5.186372428844064, 1.0914373489967295, -8.149787010746927,
     -18.52006565999696, 22.739487099350505, 2.4936055526796523, -3.0467644718982196},
    {2.273310147516538, 0.0, 0.0, -10.53449546673725, -2.0008720582248625, -17.9589318631188,
     27.94888452941996, -2.8589982771350235, -8.87285693353063, 12.360567175794303, 0.6433927460157636},
};
constexpr double END_WEIGHTS[STAGES] = {
    0.054293734116568765, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    0.3111643669578199, -0.1521609496625161, 0.20136540080403034, 0.04471061572777259,
};
constexpr double FIFTH_ORDER_ERROR[STAGES] = {
    0.01312004499419488, 0.0, 0.0, 0.0, 0.0, -1.2251564463762044, -0.4957589496572502, 1.6643771824549864,
    -0.35032884874997366, 0.3341791187130175, 0.08192320648511571, -0.022355307863886294,
};
constexpr double THIRD_ORDER_ERROR[STAGES] = {
    -0.18980075407240762, 0.0, 0.0, 0.0, 0.0, 4.450312892752409, 1.8915178993145003, -5.801203960010585,
    -0.4226823213237919, -0.1521609496625161, 0.20136540080403034, 0.02265179219836082,
};
// clang-format on
constexpr double BLEND = 0.01;  // weight of the third-order estimate in the error

// Takes one step of length `h` from `from`, whose rates are in stages[0]; `rates(at, out)` computes rates.
template <class T, int N, class Rates>
inline void dormand_prince_step(T (&stages)[STAGES][N], const T (&from)[N], const T &h, T (&to)[N], const Rates &rates) {
  T point[N];
#pragma GCC unroll 12
  for (int i = 1; i < STAGES; i++) {
    for (int q = 0; q < N; q++) {
      T sum = STAGE_WEIGHTS[i][0] * stages[0][q];
#pragma GCC unroll 12
      for (int j = 1; j < i; j++)
        if (STAGE_WEIGHTS[i][j] != 0.0) sum = sum + STAGE_WEIGHTS[i][j] * stages[j][q];
      point[q] = from[q] + h * sum;
    }
    rates(point, stages[i]);
  }
  for (int q = 0; q < N; q++) {
    T sum = END_WEIGHTS[0] * stages[0][q];
#pragma GCC unroll 12
    for (int j = 1; j < STAGES; j++)
      if (END_WEIGHTS[j] != 0.0) sum = sum + END_WEIGHTS[j] * stages[j][q];
    to[q] = from[q] + h * sum;
  }
}

// Error estimate of a step in some unknowns, divided by the allowed error. If a stage is not finite, the
// estimate is infinite; the formula would give zero, because it divides by infinity.
struct StepError {
  double fifth = 0.0, third = 0.0;

  template <class T, int N> INLINE void add(const T (&stages)[STAGES][N], int unknown, double allowed) {
    double by_fifth = 0.0, by_third = 0.0;
    for (int j = 0; j < STAGES; j++) {
      by_fifth += FIFTH_ORDER_ERROR[j] * value_of(stages[j][unknown]);
      by_third += THIRD_ORDER_ERROR[j] * value_of(stages[j][unknown]);
    }
    fifth += (by_fifth / allowed) * (by_fifth / allowed);
    third += (by_third / allowed) * (by_third / allowed);
  }
  INLINE double of_step(double h, double count) const {
    double blend = fifth + BLEND * third;
    if (blend == 0.0) return 0.0;
    return blend < 1e300 ? h * fifth / square_root(count * blend) : INFINITE;
  }
};

// Returns the ratio of the next step length to the present one; an error of NaN shortens the step.
INLINE double step_factor(double error) {
  constexpr double SAFETY = 0.9, SHRINK = 0.2, GROW = 4.0;
  if (!(error < 1e300)) return SHRINK;
  return error <= 1e-12 ? GROW : smaller(GROW, larger(SHRINK, SAFETY / eighth_root(error)));
}

// ---- Contact laws: F as a function of w and r = d|p|/dt.

// Gong et al. 2025, eq. 2: F = k_contact (|p| - gap)^(3/2).
struct HertzForce {
  double stiffness;
  template <class T> INLINE T operator()(const T &w, const T &) const { return stiffness * (w * w * w); }
};
// A linear spring in parallel with a Hertz contact, with the loss of Hunt and Crossley, J. Appl. Mech. 42
// (1975) 440, eq. 8. Either stiffness may be zero.
struct YieldingForce {
  double spring, hertz, loss;  // [N/m], [N/m^1.5], [s/m]
  template <class T> INLINE T operator()(const T &w, const T &r) const {
    return w * w * (spring + hertz * w) * (1.0 + loss * r);
  }
};

// ---- A contact

constexpr double SLOWEST_TOUCH = 1e-12;  // smallest r at w = 0 [m/s]; all derivatives vanish at w = r = 0
constexpr double ROOT_FLOOR = 1e-6;      // added to the error scale of w [m^0.5]: a penetration of 1 pm
constexpr double RATE_FLOOR = 1e-6;      // added to the error scale of r [m/s]
constexpr double STANDARD_TOLERANCE = 3e-7;  // tolerance assumed by `foreseen_step`
constexpr int MOST_CONTACT_STEPS = 100000;   // largest number of steps of one call; a contact takes about ten
constexpr int MOST_CORRECTIONS = 100;        // bisection ends a bracketed Newton iteration before this
constexpr double LANDING = 1e-11;            // a release is accepted if |w| is below this part of its scale
constexpr double STRETCH_TURN = 0.3;  // longest stretch, as drive phase [rad]. Its base force is a polynomial
                                      // of degree 7 about the middle, with a relative error of 6e-12.

template <class T> struct Contact {
  T w, r;
  double side;  // +1 or -1; 0 without contact
  double step, root_scale, rate_scale, pace;
};

// Steps always remove energy, so their errors accumulate; collisions solved as a whole do not have this
// defect. Careful steps therefore use the tolerance times STEP_CARE, but at least FINEST_STEP.
constexpr double STEP_CARE = 1e-4, FINEST_STEP = 1e-11;

INLINE double careful(double tolerance) { return smaller(tolerance, larger(STEP_CARE * tolerance, FINEST_STEP)); }
// Errors of earlier steps decay in a damped motion, but accumulate in an undamped one.
INLINE double step_tolerance(double tolerance, const Specimen &s) {
  return s.c0 + s.c1 + s.c2 + s.loss > 0.0 ? tolerance : careful(tolerance);
}

INLINE double step_scale(double tolerance) { return eighth_root(tolerance / STANDARD_TOLERANCE); }

// Returns the longest accurate step, divided by the collision's time scale; `depth` is w / its maximum.
// Steps must be half as long at the turning point, which the last error estimate cannot predict. The values
// are from Hertz collisions, which are alike at all speeds. They are slightly short for linear stops.
INLINE double foreseen_step(double depth, double rate) {
  if (rate > 0.0) return larger(1.02 - 0.95 * depth, 0.46);
  return depth > 0.93 ? 0.48 : depth > 0.65 ? 0.6 : 0.9;
}

// Starts a contact from a flight. The first step resolves the faster of two motions: the elastic collision (a
// half-wave in s about 5.1 w_max / v long) and a slow contact under the acceleration a (w'' = -(a / 2) w).
template <class T>
inline void begin_contact(Contact<T> &c, const T *motion, double side, double tolerance, const Body &t) {
  const Specimen &s = t.specimen;
  double gap = gap_at(s, side);
  T depth = side * (motion[Y] - motion[Z]) - gap;
  c.side = side;
  c.w = value_of(depth) > 0.0 ? square_root(depth) : constant<T>(0.0);
  c.r = side * (motion[VY] - motion[VZ]);
  double w = value_of(c.w), r = value_of(c.r);
  if (w == 0.0 && r < SLOWEST_TOUCH) {
    c.r = c.r + (SLOWEST_TOUCH - r);
    r = SLOWEST_TOUCH;
  }
  // Largest speed, and largest depth with each spring alone, from m v^2 / 2 = k1 d^2 / 2 + 2 k d^(5/2) / 5.
  double hertz = 0.8 * s.contact_stiffness / t.pair, spring = s.linear_stiffness / t.pair, w2 = w * w;
  double speed = square_root(r * r + hertz * w2 * w2 * w + spring * w2 * w2);
  double deepest = smaller(fifth_root(speed * speed / hertz), square_root(speed / square_root(spring)));
  double pull = s.k2 * value_of(motion[Z] - motion[X]) + s.c2 * value_of(motion[VZ] - motion[VX]);
  double press = magnitude(side * pull / s.m2 - (s.k1 * gap + s.c1 * r) / t.pair);
  c.root_scale = deepest + ROOT_FLOOR;
  c.rate_scale = speed + RATE_FLOOR;
  c.pace = deepest / speed;
  double pressed = 0.7 / square_root(0.5 * press + 1e-300);
  c.step = step_scale(step_tolerance(tolerance, s)) * foreseen_step(w / c.root_scale, r) * smaller(c.pace, pressed);
}

// Base force k0 U + c0 dU/dt [N] as a polynomial about the middle of a stretch; for a cubic, about its start.
struct BaseForce {
  double middle, terms[8];
  Phasor drive;  // the drive's phasor at the middle

  explicit BaseForce(const double (&cubic)[4]) : middle(0.0), terms{cubic[0], cubic[1], cubic[2], cubic[3]}, drive{} {}
  BaseForce(const Clock<double> &clock, double middle_s, const Tables &t) : middle(middle_s) {
    drive = drive_phasor(clock, middle, t);
    Phasor term = t.drive.force * drive;
    for (int k = 0; k < 8; k++) {
      terms[k] = term.re;
      term = term * Phasor{0.0, t.omega / (k + 1)};
    }
  }
  BaseForce(double middle_s, const double *series) : middle(middle_s), terms{}, drive{} {
    __builtin_memcpy(terms, series, sizeof terms);
  }
  // Returns the force at `tau`. Summation in pairs shortens the chain of dependent products.
  template <class T> INLINE T at(const T &tau) const {
    T u = tau - middle, u2 = u * u;
    T low = (terms[0] + terms[1] * u) + u2 * (terms[2] + terms[3] * u);
    T high = (terms[4] + terms[5] * u) + u2 * (terms[6] + terms[7] * u);
    return low + u2 * (u2 * high);
  }
};

enum { W, R, CX, CZ, CVX, CVZ, TIME, UNKNOWNS };

// Gong et al. 2025, eq. 1, in contact: derivatives of w, r, x, z, vx, vz and t with respect to s. The stop
// force is computed for the positive side and gets its sign once, so mirrored motions agree to the last bit.
template <class T, class Force> struct ContactEquations {
  const Body &t;
  const BaseForce &base;
  const Force &force;
  double side, gap;

  INLINE void operator()(const T *at, T *rates) const {
    const Specimen &s = t.specimen;
    const T &w = at[W], &r = at[R], &vx = at[CVX], &vz = at[CVZ];
    T push = s.k1 * (gap + w * w) + s.c1 * r + force(w, r);
    T pull = s.k2 * (at[CZ] - at[CX]) + s.c2 * (vz - vx);
    T drive = base.at(at[TIME]) - s.k0 * at[CX] - s.c0 * vx;
    rates[W] = 0.5 * r;
    rates[R] = w * (side * pull * t.inverse2 - push * t.inverse_pair);
    rates[CX] = w * vx;
    rates[CZ] = w * vz;
    rates[CVX] = w * ((pull + drive) * t.inverse0);
    rates[CVZ] = w * ((side * push - pull) * t.inverse2);
    rates[TIME] = w;
  }
};

enum class ContactEnd { LEFT, HELD, LOST, STALLED };

// The steps of one contact: `point` is the last accepted state, `trial` the state after the trial step.
template <class T, class Force> struct ContactSteps {
  ContactEquations<T, Force> rates;
  double tolerance;
  T stages[STAGES][UNKNOWNS];
  T point[UNKNOWNS], trial[UNKNOWNS];

  void take(const T &h) { dormand_prince_step(stages, point, h, trial, rates); }

  // Returns the error of w, r and vx. A light m0 moves faster than the contact, so vx is included.
  double error(double h, const Contact<T> &c) const {
    StepError error;
    error.add(stages, W, tolerance * (c.root_scale + magnitude(value_of(point[W]))));
    error.add(stages, R, tolerance * (c.rate_scale + magnitude(value_of(point[R]))));
    error.add(stages, CVX, tolerance * (c.rate_scale + magnitude(value_of(point[CVX]))));
    return error.of_step(h, 2.0);
  }

  // Shortens the trial step to the zero of `off` within it, by Newton's method with a bracket. Decisions use
  // only values, so values equal those of a motion without derivatives to the last bit. A final correction
  // adds the derivatives of the step length.
  template <class Off> T land(const T &longest, double close, double slope_sign, const Off &off) {
    double low = 0.0, high = value_of(longest);
    T h = longest;
    for (int n = 0; n < MOST_CORRECTIONS; n++) {
      auto [late, slope] = off();
      double from = value_of(h), rate = value_of(slope);
      if (magnitude(value_of(late)) <= close) break;
      (slope_sign * value_of(late) < 0.0 ? low : high) = from;
      double next = slope_sign * rate > 0.0 ? from - value_of(late) / rate : low;
      if (!(low < next && next < high)) {
        next = 0.5 * (low + high);
        if (!(low < next && next < high)) break;
      }
      h = constant<T>(next);
      take(h);
    }
    if constexpr (is_dual<T>) {
      auto [late, slope] = off();
      h = h - slopes_only(late) / value_of(slope);
      take(h);
    }
    return h;
  }
  T land_on_exit(const T &longest, double close) {
    struct Off { T late, slope; };
    return land(longest, close, -1.0, [&] { return Off{trial[W], 0.5 * trial[R]}; });
  }
  T land_on_time(const T &longest, const T &limit) {
    struct Off { T late, slope; };
    // Times are exact to a few units in the last place.
    double close = 4.0 * EPSILON * (magnitude(value_of(limit)) + magnitude(value_of(point[TIME])));
    T h = land(longest, close, 1.0, [&] { return Off{T(trial[TIME] - limit), trial[W]}; });
    trial[TIME] = limit;
    return h;
  }
};

// Advances a contact from time `tau` to `limit` on the clock of `base`, or until m1 leaves the stop; then
// `contact.side` is 0. `seen(steps, h)` is called for each accepted step, before `point` is updated.
template <class T, class Force, class Seen>
inline ContactEnd advance_contact(Contact<T> &c, T *motion, T &tau, const T &limit, const BaseForce &base,
                                  const Force &force, double allowed, const Body &t, const Seen &seen) {
  double tolerance = step_tolerance(allowed, t.specimen);
  double gap = gap_at(t.specimen, c.side), step = c.step, longest = c.pace * step_scale(tolerance);
  if (!(value_of(tau) < value_of(limit))) return ContactEnd::HELD;
  ContactSteps<T, Force> steps{{t, base, force, c.side, gap}, tolerance, {}, {}, {}};
  T (&point)[UNKNOWNS] = steps.point, (&trial)[UNKNOWNS] = steps.trial;
  const T start[UNKNOWNS] = {c.w, c.r, motion[X], motion[Z], motion[VX], motion[VZ], tau};
  for (int q = 0; q < UNKNOWNS; q++) point[q] = start[q];
  steps.rates(point, steps.stages[0]);
  ContactEnd end = ContactEnd::STALLED;
  for (int n = 0; n < MOST_CONTACT_STEPS; n++) {
    T h = constant<T>(step);
    steps.take(h);
    double error = steps.error(step, c), factor = step_factor(error);
    if (!(error <= 1.0)) {
      step *= smaller(factor, 1.0);
      if (step < 1e-300) return ContactEnd::LOST;
      continue;
    }
    if (value_of(trial[W]) <= 0.0) {
      h = steps.land_on_exit(h, LANDING * c.root_scale);
      end = ContactEnd::LEFT;
    }
    if (value_of(trial[TIME]) >= value_of(limit)) {
      h = steps.land_on_time(h, limit);
      end = ContactEnd::HELD;
    }
    if (value_of(trial[TIME]) < value_of(point[TIME])) {
      // Time decreases while w < 0: the step went beyond the release and returned. Try half of it.
      step *= 0.5;
      end = ContactEnd::STALLED;
      continue;
    }
    seen(steps, h);
    for (int q = 0; q < UNKNOWNS; q++) point[q] = trial[q];
    if (end == ContactEnd::LEFT) point[W] = constant<T>(0.0);
    if (end != ContactEnd::STALLED) break;
    steps.rates(point, steps.stages[0]);
    step *= factor;
    double depth = value_of(point[W]) / c.root_scale;
    // The predicted step length is valid only up to about the predicted largest depth.
    if (depth < 1.05) step = smaller(step, longest * foreseen_step(depth, value_of(point[R])));
  }
  c.w = point[W], c.r = point[R], c.step = step;
  motion[X] = point[CX], motion[Z] = point[CZ], motion[VX] = point[CVX], motion[VZ] = point[CVZ];
  motion[Y] = point[CZ] + c.side * (gap + point[W] * point[W]);
  motion[VY] = point[CVZ] + c.side * point[R];
  tau = point[TIME];
  if (end == ContactEnd::LEFT) c.side = 0.0;
  return end;
}

}  // namespace vibench
