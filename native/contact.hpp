// Contact with a compliant stop, integrated from touch to release in steps with error control (decisions 0004
// and 0008). With |p| = gap + w^2 and dt = w ds, the force of eq. 2 is k w^3, and every derivative is a
// polynomial. This removes the kink of penetration^(3/2), and makes touch and release simple zeros of w.
#pragma once
#include "dormand_prince.hpp"
#include "flight.hpp"

namespace vibench {

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
