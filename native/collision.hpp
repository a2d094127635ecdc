// A complete Hertz collision: depths at sixteen points and the duration, by Newton's method (decision 0008).
// With time = duration (1 - cos phi) / 2 the depth is smooth in phi, also at both ends, so sixteen points
// represent it. Scaled by depth and duration, collisions differ only by the force of the other springs (the
// "press"). Shapes and their response to a misfit are tabulated over the press; a few corrections follow.
#pragma once
#include "flight.hpp"

namespace vibench {

enum { POINTS = 16, SLOW_TERMS = 6, MOST_SHAPE_CORRECTIONS = 8 };
// Rows of `CollisionShapes::shapes` after the first sixteen rows, which are responses to depth misfits.
enum ShapeRow { TO_DURATION = POINTS, ONTO_DURATION, DEPTHS, BY_PRESS, BY_JERK, BY_DAMPER, BY_SPRING };
enum DurationColumn { DURATION, END_ONTO_DURATION, DEEPER, LASTS_BY };
constexpr double SOFTEST = -0.3, HARDEST = 0.5, SPACING = (HARDEST - SOFTEST) / 40;  // tabulated presses
constexpr double LONGEST = 3.5;         // duration at the HARDEST press, in units of depth over speed
constexpr double LONGEST_COLLISION = 0.4;  // limit of fastest rate times duration, for the series [rad]
constexpr double HALF_FORCE = 1.25;     // k / m in units of depth and speed, from m v^2 / 2 = 2 k d^(5/2) / 5
constexpr double LEAST_TOLERANCE = 1e-7;  // sixteen points are not accurate enough for stricter tolerances
constexpr double CLOSE = 0.1;  // corrections end when changes of depths are below this part of the tolerance
constexpr double LAG = 3e-6;  // the force's slow terms are recomputed if depths change by more than this

// One collision. Coordinates are mirrored so that p is positive at either stop.
template <class T> struct Collision {
  Wide<T, POINTS> depths;  // depths at the points, divided by `unit`
  Wide<T, POINTS> force;   // contact force at the points [N]
  Wide<T, WIDE> motion;    // motion at the start
  Wide<T, WIDE> after;     // motion at the end
  Wide<T, TERMS> course;   // Taylor terms of p without contact force, in powers of fastest * t
  Wide<T, TERMS> moments;  // integrals of the force up to the end
  T duration;              // [s]
  double unit;             // depth of a collision of this speed without other forces [m]
  double pace;             // unit over speed [s]
  int press;               // row of the tables
};

template <class T> INLINE Wide<T, POINTS> constants(const double (&of)[POINTS]) {
  Wide<T, POINTS> row{};
  if constexpr (is_dual<T>) row.value = Vector<POINTS>::load(of);
  else row = Vector<POINTS>::load(of);
  return row;
}

// Returns the sum of a Taylor series without its constant term, at the scaled times `turns` of the points.
template <class T>
INLINE Wide<T, POINTS> series_at_points(const Wide<T, TERMS> &terms, const Wide<T, POINTS> &turns) {
  Wide<T, POINTS> sum = at(terms, TERMS - 1) * turns;
  for (int m = TERMS - 2; m > 0; m--) sum = (sum + at(terms, m)) * turns;
  return sum;
}

// Returns the effect of the contact force on one coordinate at the points, from terms `first` to `last` - 1.
template <class T>
INLINE Wide<T, POINTS> pushed(const Wide<T, POINTS> &force, int first, int last, int number, const T &duration,
                              const CollisionTables &t) {
  T turn = t.fastest * duration, factor = duration;
  for (int m = 0; m < first; m++) factor = factor * turn;
  Wide<T, POINTS> sum = (factor * t.struck[first][number]) * times(t.shapes->shares[first], force);
  for (int m = first + 1; m < last; m++) {
    factor = factor * turn;
    sum = sum + (factor * t.struck[m][number]) * times(t.shapes->shares[m], force);
  }
  return sum;
}

// Returns whether a correction is small enough to be the last; for dual numbers, its derivatives decide.
INLINE bool is_settled(const Vector<POINTS> &change, const Vector<POINTS> &, double close) {
  return total(change * change) <= close * close;
}
template <int M>
INLINE bool is_settled(const Dual<Vector<POINTS>, M> &change, const Dual<Vector<POINTS>, M> &depths, double) {
  for (int i = 0; i < M; i++)
    if (!(total(change.slope[i] * change.slope[i]) <= 1e-20 * total(depths.slope[i] * depths.slope[i]))) return false;
  return true;
}

// Corrects depths and duration until they satisfy the equations; `begun` is p - gap at the start [m]. For
// duals the values are already solved and stay unchanged, so both kinds of motion agree to the last bit.
template <class T> inline bool correct(Collision<T> &c, const T &begun, double close, const Tables &tables) {
  const CollisionTables &t = tables.collision;
  const auto &shape = t.shapes->shapes[c.press];
  double end_onto_duration = t.shapes->durations[c.press][END_ONTO_DURATION];
  double stiff = tables.specimen.contact_stiffness * c.unit * square_root(c.unit), over = 1.0 / c.unit;
  Wide<T, POINTS> slow{};
  bool is_slow_known = false;
  for (int n = 0; n < MOST_SHAPE_CORRECTIONS * (is_dual<T> ? 2 : 1); n++) {
    c.force = stiff * (c.depths * square_root(c.depths));
    c.moments = times(t.shapes->ends, c.force);
    if (!is_slow_known) slow = pushed<T>(c.force, 2, SLOW_TERMS, P, c.duration, t);
    T turn = t.fastest * c.duration, end = constant<T>(0.0);
    for (int m = TERMS - 1; m > 0; m--)
      end = turn * (end + at(c.course, m) + c.duration * t.struck[m][P] * at(c.moments, m));
    end = over * (begun + end);
    Wide<T, POINTS> free = series_at_points<T>(c.course, turn * Vector<POINTS>::load(t.shapes->heights));
    Wide<T, POINTS> there = begun + free + slow + pushed<T>(c.force, 1, 2, P, c.duration, t);
    Wide<T, POINTS> misfit = over * there - c.depths;
    Wide<T, POINTS> change = end * Vector<POINTS>::load(shape[TO_DURATION]) + times(shape, misfit);
    T later = end_onto_duration * end + total(Vector<POINTS>::load(shape[ONTO_DURATION]) * misfit);
    if constexpr (is_dual<T>) change.value = Vector<POINTS>(0.0), later.value = 0.0;
    c.depths = c.depths - change;
    c.duration = c.duration - c.pace * later;
    if (is_settled(change, c.depths, close)) {
      c.force = stiff * (c.depths * square_root(c.depths));
      c.moments = times(t.shapes->ends, c.force);
      return true;
    }
    if constexpr (!is_dual<T>) is_slow_known = total(change * change) <= LAG * LAG;
  }
  return false;
}

// Predicts depths and duration from the tables, linearised in the press and three smaller parameters.
inline void foresee(Collision<double> &c, double press, const Tables &tables) {
  const CollisionTables &t = tables.collision;
  c.press = int((press - SOFTEST) / SPACING + 0.5);
  const auto &shape = t.shapes->shapes[c.press];
  const auto &known = t.shapes->durations[c.press];
  // All parameters are in units of the collision: `unit` for depth, `pace` for time.
  double turn = t.fastest * c.pace, stiff = tables.specimen.contact_stiffness * c.unit * square_root(c.unit);
  double kick = turn * stiff * c.pace / (c.unit * HALF_FORCE);
  double by[4] = {press - (SOFTEST + SPACING * c.press), c.course[3] * turn * turn * turn / c.unit,
                  t.struck[2][P] * turn * kick, t.struck[3][P] * turn * turn * kick};
  c.depths = Vector<POINTS>::load(shape[DEPTHS]);
  c.duration = known[DURATION];
  for (int k = 0; k < 4; k++) {
    c.depths = c.depths + by[k] * Vector<POINTS>::load(shape[BY_PRESS + k]);
    c.duration += by[k] * known[LASTS_BY + k];
  }
  c.duration *= c.pace;
}

// Computes the motion at the end of the collision.
template <class T> inline void move_on(Collision<T> &c, const CollisionTables &t) {
  T turn = t.fastest * c.duration, factor = constant<T>(1.0);
  c.after = c.motion + (c.duration * at(c.moments, 0)) * Vector<WIDE>::load(t.struck[0]);
  for (int m = 1; m < TERMS; m++) {
    factor = factor * turn;
    Wide<T, WIDE> moved = times(t.powers[m], c.motion);
    c.after = c.after + factor * (moved + (c.duration * at(c.moments, m)) * Vector<WIDE>::load(t.struck[m]));
  }
}

template <class T> INLINE Collision<double> values_of(const Collision<T> &c) {
  return {value_of(c.depths),  value_of(c.force),    value_of(c.motion), value_of(c.after), value_of(c.course),
          value_of(c.moments), value_of(c.duration), c.unit,             c.pace,            c.press};
}

// Solves the collision that starts with c.motion and c.course; `pace` as in `Contact`. Returns false if the
// contact needs the steps of contact.hpp: at nearly zero speed, with springs as fast as the collision, with
// the end of the run inside the collision, or for a tolerance below LEAST_TOLERANCE.
template <class T>
inline bool find_collision(Collision<T> &c, double gap, double pace, double longest, double tolerance,
                           const Tables &tables) {
  double speed = value_of(at(c.motion, P_RATE)), fastest = tables.collision.fastest;
  if (tolerance < LEAST_TOLERANCE || !(speed > 0.0)) return false;
  double w = pace * speed;  // expected largest w
  double most = smaller(longest, LONGEST_COLLISION / fastest);
  if (!(LONGEST * w * w < speed * most)) return false;
  Collision<double> values;
  values.motion = value_of(c.motion), values.course = value_of(c.course);
  values.unit = w * w;
  values.pace = values.unit / speed;
  double press = 2.0 * values.course[2] * fastest * fastest * values.pace / speed;
  if (!(SOFTEST <= press && press <= HARDEST)) return false;
  foresee(values, press, tables);
  if (!correct<double>(values, values.motion[P] - gap, CLOSE * tolerance, tables)) return false;
  if (!(0.0 < values.duration && values.duration < most)) return false;
  if constexpr (is_dual<T>) {
    c.unit = values.unit, c.pace = values.pace, c.press = values.press;
    c.depths = {}, c.depths.value = values.depths;
    c.duration = constant<T>(values.duration);
    return correct<T>(c, at(c.motion, P) - gap, 0.0, tables);
  } else {
    c = values;
    return true;
  }
}

// Advances a motion that has just touched the stop at `side` to the end of its collision. Returns false and
// leaves the motion unchanged if the collision cannot be solved.
template <class T>
inline bool collide(Collision<T> &c, T *motion, double side, double pace, const Complex<T> &drive, double longest,
                    double tolerance, const Tables &tables) {
  const CollisionTables &t = tables.collision;
  double gap = gap_at(tables.specimen, side);
  const T begins[WIDE] = {side * (motion[Y] - motion[Z]),   side * motion[X],  side * motion[Z],
                          side * (motion[VY] - motion[VZ]), side * motion[VX], side * motion[VZ],
                          side * drive.re,                  side * drive.im};
  c.motion = gathered(begins);
  c.course = times(t.onto_p, c.motion);
  if (!find_collision(c, gap, pace, longest, tolerance, tables)) return false;
  move_on(c, t);
  if (!(value_of(at(c.after, P_RATE)) < 0.0)) return false;
  motion[X] = side * at(c.after, AT_X), motion[Z] = side * at(c.after, AT_Z);
  motion[VX] = side * at(c.after, X_RATE), motion[VZ] = side * at(c.after, Z_RATE);
  motion[Y] = motion[Z] + side * gap;
  motion[VY] = motion[VZ] + side * at(c.after, P_RATE);
  return true;
}

// A Hertz collision as polynomials for batches, without iteration (decision 0061). The units are depth and
// time u of a collision of the same speed without other forces. In these units a collision depends only on u
// and on the acceleration of p by all other springs. The polynomials' variables are this acceleration at the
// middle, its first four derivatives, and u. Their values are the duration and the moments of the force about
// the middle. `vibench.sim.engine` fits them to solved collisions.

constexpr int DERIVATIVES = 5;              // the acceleration and its first four derivatives
constexpr int VARIABLES = DERIVATIVES + 1;  // these derivatives and u
constexpr int MOMENTS = 5;
constexpr int POLYNOMIALS = 1 + MOMENTS;    // the duration over u, and the moments
constexpr double COLLISION_MIDDLE = 1.47;   // time of the middle of a collision, divided by u
constexpr int MONOMIALS = 289;
constexpr int COEFFICIENTS = sizeof(CollisionFit::coefficients) / sizeof(double);

// Factors by which one more power of each variable reduces the estimated contribution of a monomial.
constexpr double ADDS[VARIABLES] = {0.3, 0.08, 0.015, 0.002, 2e-4, 0.03};
// Monomials with smaller contributions are omitted from a polynomial. Higher moments need less accuracy.
constexpr double LEAST_ADDED[POLYNOMIALS] = {1e-6, 1e-7, 3e-6, 1e-4, 4e-3, 0.05};

// A monomial: the product of the earlier monomial `before` and one variable. The first monomial is 1.
struct Monomial {
  int powers[VARIABLES];
  double adds;
  int before, variable;
};
struct Monomials {
  Monomial of[MONOMIALS];    // sorted by contribution, the largest first
  int counts[POLYNOMIALS];   // number of leading monomials in each polynomial
  int first[POLYNOMIALS];    // index of the first coefficient of each polynomial
  int count, coefficients;
};

// Adds all products of `partly` and powers of `variable` and later variables, sorted by contribution.
constexpr void add_monomials(Monomials &to, Monomial partly, int variable) {
  if (variable == VARIABLES) {
    int place = to.count++;
    for (; place > 0 && to.of[place - 1].adds < partly.adds; place--) to.of[place] = to.of[place - 1];
    to.of[place] = partly;
    return;
  }
  for (; partly.adds >= LEAST_ADDED[1]; partly.powers[variable]++, partly.adds *= ADDS[variable])
    add_monomials(to, partly, variable + 1);
}

constexpr Monomials make_monomials() {
  Monomials made{};
  add_monomials(made, {{}, 1.0, 0, 0}, 0);
  for (int k = 1; k < made.count; k++) {
    int before[VARIABLES], variable = 0;
    while (made.of[k].powers[variable] == 0) variable++;
    for (int i = 0; i < VARIABLES; i++) before[i] = made.of[k].powers[i] - (i == variable);
    for (int j = 0; j < k; j++) {
      bool is_it = true;
      for (int i = 0; i < VARIABLES; i++) is_it = is_it && made.of[j].powers[i] == before[i];
      if (is_it) made.of[k].before = j;
    }
    made.of[k].variable = variable;
  }
  for (int n = 0; n < POLYNOMIALS; n++) {
    made.first[n] = made.coefficients;
    while (made.counts[n] < made.count && made.of[made.counts[n]].adds >= LEAST_ADDED[n]) made.counts[n]++;
    made.coefficients += made.counts[n];
  }
  return made;
}

constexpr Monomials THE_MONOMIALS = make_monomials();
static_assert(THE_MONOMIALS.count == MONOMIALS && THE_MONOMIALS.coefficients == COEFFICIENTS);

// Passes the monomials to Python, which fits them; returns their number.
inline int64_t describe_collisions(const CollisionMonomials &to) {
  for (int k = 0; k < MONOMIALS; k++)
    for (int i = 0; i < VARIABLES; i++) to.powers.at[k * VARIABLES + i] = THE_MONOMIALS.of[k].powers[i];
  for (int n = 0; n < POLYNOMIALS; n++) to.counts.at[n] = THE_MONOMIALS.counts[n];
  return MONOMIALS;
}

// Evaluates the polynomials at eight points at once. clang unrolls the loop: every index is a constant, and
// the sums stay in registers. g++, used only for tests, keeps the loop, with the same order of summation.
template <class T>
inline void evaluate(T (&values)[POLYNOMIALS], const T (&variables)[VARIABLES],
                     const double (&coefficients)[COEFFICIENTS]) {
  constexpr int CHAINS = 4;  // independent sums
  T found[MONOMIALS], sums[POLYNOMIALS][CHAINS] = {};
#if defined(__clang__)
#pragma clang loop unroll(full)
#endif
  for (int k = 0; k < MONOMIALS; k++) {
    const Monomial &monomial = THE_MONOMIALS.of[k];
    found[k] = k == 0 ? constant<T>(1.0) : found[monomial.before] * variables[monomial.variable];
    for (int n = 0; n < POLYNOMIALS; n++)
      if (k < THE_MONOMIALS.counts[n])
        sums[n][k % CHAINS] = fused(Vector<8>(coefficients[THE_MONOMIALS.first[n] + k]), found[k], sums[n][k % CHAINS]);
  }
  for (int n = 0; n < POLYNOMIALS; n++) values[n] = (sums[n][0] + sums[n][1]) + (sums[n][2] + sums[n][3]);
}

}  // namespace vibench
