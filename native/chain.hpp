// A chain of cells: specimens whose m0 are coupled in series (decision 0011). It advances in time windows.
// Within a window the motion without contact forces is one Taylor polynomial per displacement, from eq. 1. A
// cell that may touch a stop is integrated separately: the known motion of its neighbours drives its m0. The
// effect of its contact force F on the chain is added at the window's end. With the chain's equations
// s' = A s + b F, the effect is sum_k A^k b M_k, where M_k is the integral of F(t) (end - t)^k / k!.
#pragma once
#include "power_law.hpp"

namespace vibench {

constexpr int WINDOW_MOMENTS = 9;           // number of M_k; the next is below 7e-10 of the first at 0.4 rad
constexpr int BLOCK = 8;             // cells in parallel; a force reaches fewer cells per side in a window
constexpr int NUMBERS = 3;           // displacements of a cell, at indices P, AT_X, AT_Z; their rates follow
constexpr int PIECE_TERMS = 8;
constexpr double LONGEST_WINDOW = 0.5;  // limit of fastest rate times length, so that AHEAD terms suffice [rad]
constexpr double IDLE_WINDOWS = 2.0;  // longest window without contacts, divided by the longest other window
constexpr int MOST_TOUCHES = 1000;   // largest number of touches of a cell in a window
constexpr int MOST_STRETCHES = 100000;  // largest number of flights, contacts and steps of a cell in a window
// A window is cut at a late touch only if this saves time: if the number of cells integrated separately, plus
// one for each CELLS_AS_ONE cells of the chain, is at most MOST_CUT. Otherwise contact steps cost less.
constexpr int64_t MOST_CUT = 12, CELLS_AS_ONE = 16;
constexpr double SOON = 1e-3;        // a touch in this first fraction of a window does not cut it
constexpr double HAIR = 1e-12;       // a contact beginning in this last part continues in the next window
constexpr double ROUNDED_PIECE = 1e-9;  // below this, the rest of a piece of the drive is rounding error
// Constants for steps under a power law, whose windows are short; see power_law.hpp.
constexpr double FINER_FIT = 0.01, CLOSE_PLACE = 1e-3, CLOSEST_PLACE = 1e-15, CELL_FADING = 0.999;
constexpr double LONGER_STEP = 1.4142135623730951, SHORTER_STEP = 0.5;
constexpr int MOST_TRIES = 200;      // largest number of tries of a step, each half as long as the last

// One value per cell, with a block of zeros before and after as neighbours of the first and last cell.
using Row = double *;
struct Rows {
  Row of[NUMBERS];
};

// Data of a kind of cell, shared by all cells of this kind.
struct KindTables {
  Tables tables;                  // tables of a specimen with springs to the cells before and after
  double struck[WINDOW_MOMENTS][WIDE];   // like `CollisionTables::struck`
  PowerForce power;
  double link[2][2];              // stiffness and damping of the links before and after
  double gain_length;             // length of the step for which `gain` was computed [s]
  double gain[GAUSS][GAUSS];      // change of p at each Gauss point per force at each Gauss point [m/N]
};

struct CellMotion {
  double at[2 * NUMBERS];         // P, AT_X, AT_Z, and their rates
  Contact<double> contact;
  double power_step, size;
  double moments[WINDOW_MOMENTS];        // M_k of the force so far, for the time at which `cross` ends
};

// Pointers to the arrays of a run in the caller's memory, which is zeroed first.
struct ChainMemory {
  int64_t cells, kinds, padded;
  double *base;
  int64_t used = 0;
  Row inverse0, inverse2, inverse_pair, k0, k1, k2, c0, c1, c2;
  Rows terms[AHEAD];              // Taylor terms in the window
  Rows end[2], sampled[2], heard[3];  // motion at the window's end, at a sample, and by contact forces alone
  Row bounds[2];                  // bounds of the accelerations of p and x in the window
  CellMotion *now, *begun;        // separately integrated cells: motion now, and at the window's start
  int64_t *busy;                  // indices of the separately integrated cells, ascending
  KindTables *tables;

  ChainMemory(double *memory, int64_t cell_count, int64_t kind_count)
      : cells(cell_count), kinds(kind_count), padded((cell_count + BLOCK - 1) / BLOCK * BLOCK), base(memory) {
    Row *single[] = {&inverse0, &inverse2, &inverse_pair, &k0, &k1, &k2, &c0, &c1, &c2, &bounds[0], &bounds[1]};
    Rows *triple[] = {&end[0], &end[1], &sampled[0], &sampled[1], &heard[0], &heard[1], &heard[2]};
    for (Row *each : single) *each = row();
    for (Rows &each : terms) rows(each);
    for (Rows *each : triple) rows(*each);
    now = reinterpret_cast<CellMotion *>(take(cells * int64_t(sizeof(CellMotion) / sizeof(double))));
    begun = reinterpret_cast<CellMotion *>(take(cells * int64_t(sizeof(CellMotion) / sizeof(double))));
    busy = reinterpret_cast<int64_t *>(take(cells));
    tables = reinterpret_cast<KindTables *>(take(kinds * int64_t(sizeof(KindTables) / sizeof(double))));
  }

 private:
  double *take(int64_t count) {
    double *at = base == nullptr ? nullptr : base + used;
    used += count;
    return at;
  }
  Row row() {
    double *at = take(padded + 2 * BLOCK);
    return at == nullptr ? nullptr : at + BLOCK;
  }
  void rows(Rows &each) {
    for (Row &one : each.of) one = row();
  }
};

// ---- One cell

// Shifts the origin of a polynomial by `by`.
inline void shift(double *series, double by) {
  for (int low = 0; low + 1 < AHEAD; low++)
    for (int k = AHEAD - 2; k >= low; k--) series[k] += by * series[k + 1];
}

// Moves the end time of the integrals M_k by `by`, without a force: M_k grows by parts of the lower moments.
inline void age(double *moments, double by) {
  double shares[WINDOW_MOMENTS] = {1.0};  // by^k / k!
  for (int k = 1; k < WINDOW_MOMENTS; k++) shares[k] = shares[k - 1] * by * (1.0 / k);
  for (int k = WINDOW_MOMENTS - 1; k > 0; k--)
    for (int back = 1; back <= k; back++) moments[k] += shares[back] * moments[k - back];
}

// Taylor terms of p, x and z of a cell without contact force. `push` is the force of the neighbours on m0.
struct CellCourse {
  double of[NUMBERS][AHEAD];

  CellCourse(const double *at, const double *push, const Tables &t) {
    const Specimen &s = t.specimen;
    double (&p)[AHEAD] = of[P], (&x)[AHEAD] = of[AT_X], (&z)[AHEAD] = of[AT_Z];
    for (int n = 0; n < NUMBERS; n++) of[n][0] = at[n], of[n][1] = at[n + NUMBERS];
    for (int k = 0; k + 2 < AHEAD; k++) {
      double next = k + 1, share = 1.0 / ((k + 1.0) * (k + 2.0));
      double pull = s.k2 * (z[k] - x[k]) + s.c2 * next * (z[k + 1] - x[k + 1]);
      double press = s.k1 * p[k] + s.c1 * next * p[k + 1];
      p[k + 2] = share * (pull * t.inverse2 - press * t.inverse_pair);
      x[k + 2] = share * t.inverse0 * (pull + push[k] - s.k0 * x[k] - s.c0 * next * x[k + 1]);
      z[k + 2] = share * t.inverse2 * (press - pull);
    }
  }
  void place(double *at, double later) const {
    for (int n = 0; n < NUMBERS; n++) {
      ValueAndRate there = polynomial_at(of[n], later);
      at[n] = there.value, at[n + NUMBERS] = there.rate;
    }
  }
  double *operator[](int number) { return of[number]; }
  const double *operator[](int number) const { return of[number]; }
};

// Returns the largest magnitude over a flight, at least `best`. Searches only if a bound is above `best`.
inline double course_peak(double best, const double *series, double length) {
  double ends = larger(magnitude(series[0]), magnitude(polynomial_at(series, length).value));
  if (ends + derivative_bound(series, length, 2) * length * length / 8.0 <= best) return best;
  return series_peak(best, series, 0.0, length);
}

// Computes the Hertz collision of a cell that has just touched its stop. Returns whether it was solved.
inline bool collide_cell(Collision<double> &c, CellMotion &cell, const CellCourse &course, double longest,
                         double tolerance, const KindTables &kind) {
  const CollisionTables &t = kind.tables.collision;
  double side = cell.contact.side, gap = gap_at(kind.tables.specimen, side), factor = side;
  c.motion = c.after = Vector<WIDE>(0.0);
  for (int n = 0; n < 2 * NUMBERS; n++) c.motion.set(n, side * cell.at[n]);
  for (int m = 0; m < TERMS; m++) {
    c.course.set(m, factor * course[P][m]);
    factor /= t.fastest;
  }
  if (!find_collision(c, gap, cell.contact.pace, longest, tolerance, kind.tables)) return false;
  double after[2 * NUMBERS];
  course.place(after, c.duration);
  for (int n = 0; n < 2 * NUMBERS; n++) c.after.set(n, side * after[n]);
  double turn = 1.0;
  for (int m = 0; m < TERMS; m++) {
    c.after = c.after + (turn * c.duration * c.moments[m]) * Vector<WIDE>::load(t.struck[m]);
    turn *= t.fastest * c.duration;
  }
  if (!(c.after[P_RATE] < 0.0)) return false;
  for (int n = 0; n < 2 * NUMBERS; n++) cell.at[n] = side * c.after[n];
  cell.at[P] = side * gap;
  cell.contact.side = 0.0;
  return true;
}

// A step of one cell under a power law. F at Gauss points is found by iteration, as in power_law.hpp.
struct CellStep {
  KindTables &kind;
  const PowerShapes &shapes;
  const CellCourse &course;       // motion without the law's force, from the start of the step
  double length;
  Vector<GAUSS> force, places;
  double moments[WINDOW_MOMENTS];        // integrals of force times (1 - s)^m over s from 0 to 1 (the step)
  double after[2 * NUMBERS];

  // Tries the step. Returns its misfit divided by the allowed misfit.
  double attempt(const CellMotion &cell, double tolerance) {
    if (length != kind.gain_length) {
      kind.gain_length = length;
      for (auto &row : kind.gain)
        for (double &each : row) each = 0.0;
      add_shares(P, [&](double factor, int m) {
        for (int k = 0; k < GAUSS; k++) add_row(kind.gain[k], factor, shapes.shares[m][k]);
      });
    }
    Vector<GAUSS> free = course_at(P);
    double weight = length * length * kind.tables.inverse_pair;
    double size = larger(larger(cell.size, magnitude(cell.at[P])), largest(magnitude(free))) + NOTHING_MOVES;
    double close = size * larger(CLOSE_PLACE * tolerance, CLOSEST_PLACE), first = kind.power(cell.at[P]);
    force = Vector<GAUSS>(first);
    if (!substitute(force, places, kind.power, kind.gain, free, weight, close)) return INFINITE;
    for (int m = 0; m < WINDOW_MOMENTS; m++) moments[m] = total(Vector<GAUSS>::load(shapes.ends[m]) * force);
    course.place(after, length);
    for (int n = 0; n < 2 * NUMBERS; n++) add_shares(n, [&](double factor, int m) { after[n] += factor * moments[m]; });
    double before = total(Vector<GAUSS>::load(shapes.at_start) * force) - first;
    double behind = total(Vector<GAUSS>::load(shapes.at_end) * force) - kind.power(after[P]);
    return weight * larger(magnitude(before), magnitude(behind)) / (FINER_FIT * FIT * tolerance * size);
  }

  // Returns the largest magnitude of a displacement over the step, at least `best`.
  double peak(double best, int number, const CellMotion &cell) const {
    ValueAndRate first{cell.at[number], cell.at[number + NUMBERS]}, last{after[number], after[number + NUMBERS]};
    best = larger(best, larger(magnitude(first.value), magnitude(last.value)));
    if (!may_peak(best, first, last, length)) return best;
    StepCourse all{{first.value}, {first.rate}, length, shapes};
    pushed_at(number).store(all.value + 1), pushed_at(number + NUMBERS).store(all.rate + 1);
    all.value[INSTANTS - 1] = last.value, all.rate[INSTANTS - 1] = last.rate;
    return all.peak(best);
  }

 private:
  // Calls add(factor, m) for each m. A coordinate grows by `factor` times the m-th integral of the force.
  template <class Add> void add_shares(int number, const Add &add) const {
    double factor = length;
    for (int m = 0; m < WINDOW_MOMENTS; m++) {
      add(factor * kind.struck[m][number], m);
      factor *= kind.tables.collision.fastest * length;
    }
  }
  Vector<GAUSS> course_at(int number) const {
    const double *series = course[number % NUMBERS];
    Vector<GAUSS> times = length * Vector<GAUSS>::load(shapes.points), sum(0.0);
    if (number < NUMBERS)
      for (int k = AHEAD - 1; k >= 0; k--) sum = sum * times + series[k];
    else
      for (int k = AHEAD - 1; k > 0; k--) sum = sum * times + k * series[k];
    return sum;
  }
  Vector<GAUSS> pushed_at(int number) const {
    Vector<GAUSS> sum = course_at(number);
    add_shares(number, [&](double factor, int m) { sum = sum + factor * times(shapes.shares[m], force); });
    return sum;
  }
};

// ---- A run

class ChainRun {
 public:
  explicit ChainRun(ChainMotion &motion)
      : m(motion), at(motion.memory.at, motion.kind_of.size, motion.kinds.size / KIND_SIZE),
        states(reinterpret_cast<CellState *>(motion.states.at)), clock{motion.clock_high, motion.clock_low, 0.0} {
    __builtin_memset(motion.memory.at, 0, size_t(at.used) * sizeof(double));
    for (int64_t k = 0; k < at.kinds; k++) fill_kind(at.tables[k], kind(k));
    for (int64_t i = 0; i < at.cells; i++) {
      const CellKind &of = kind(kind_of(i));
      const Specimen &s = of.specimen;
      at.inverse0[i] = 1.0 / s.m0, at.inverse2[i] = 1.0 / s.m2, at.inverse_pair[i] = 1.0 / s.m1 + 1.0 / s.m2;
      at.k0[i] = s.k0, at.k1[i] = s.k1, at.k2[i] = s.k2, at.c0[i] = s.c0, at.c1[i] = s.c1, at.c2[i] = s.c2;
      const CellState &c = states[i];
      const double begins[] = {c.p, c.x, c.z, c.vp, c.vx, c.vz};
      for (int n = 0; n < NUMBERS; n++) at.terms[0].of[n][i] = begins[n], at.terms[1].of[n][i] = begins[n + NUMBERS];
      at.now[i] = {{}, {c.root, c.rate, c.side, c.step, c.root_scale, c.rate_scale, c.pace}, c.power_step, c.size, {}};
    }
  }

  // Determines which cells start on a stop.
  void start() {
    for (int64_t i = 0; i < at.cells; i++) {
      const Tables &t = at.tables[kind_of(i)].tables;
      gather(at.now[i], i);
      double p = at.now[i].at[P];
      at.now[i].contact = {}, at.now[i].power_step = at.now[i].size = 0.0;
      if (t.specimen.law == POWERS) at.now[i].contact.side = 1.0;  // the law acts at every p
      else if (p > t.specimen.upper_gap || p < -t.specimen.lower_gap) touch(at.now[i], with_sign_of(1.0, p), t);
    }
    keep();
  }

  Outcome advance() {
    Outcome outcome = REACHED_END;
    while (outcome == REACHED_END) {
      double left = time_until(clock, m.until);
      if (!(left > 0.0)) break;
      outcome = m.windows_left-- > 0 ? cross_window(left) : TOO_LONG;
    }
    keep();
    return outcome;
  }

 private:
  static constexpr int64_t KIND_SIZE = sizeof(CellKind) / sizeof(double);
  enum class Purpose { MOTION, SAMPLE };

  ChainMotion &m;
  ChainMemory at;
  CellState *states;
  Clock<double> clock;
  double push[AHEAD];             // force of the base on the first m0 in this window [N]
  int64_t followed = 0;           // number of cells integrated separately
  double full_length = 0.0;       // length of the window before it is cut [s]
  double cut = 0.0;               // earlier end of the window before a collision [s]; 0 if it is not cut

  const CellKind &kind(int64_t k) const { return reinterpret_cast<const CellKind *>(m.kinds.at)[k]; }
  int64_t kind_of(int64_t cell) const { return int64_t(m.kind_of.at[cell]); }
  bool watches() const { return m.watch != WATCH_NOTHING; }
  double step_tolerance() const { return careful(m.tolerance); }

  void fill_kind(KindTables &k, const CellKind &of) const {
    Specimen s = of.specimen;
    k.link[0][0] = s.k0, k.link[0][1] = s.c0, k.link[1][0] = of.next_stiffness, k.link[1][1] = of.next_damping;
    s.k0 += of.next_stiffness, s.c0 += of.next_damping;
    Tables &t = k.tables;
    fill_body(t, s);
    t.collision.fastest = m.fastest, t.collision.shapes = m.collisions;
    double powers[WINDOW_MOMENTS][WIDE][WIDE];
    fill_series(powers, k.struck, m.fastest, s, Drive{});
    __builtin_memcpy(t.collision.struck, k.struck, sizeof t.collision.struck);
    if (s.law == POWERS) k.power = power_force(of.power);
  }

  void keep() {
    for (int64_t i = 0; i < at.cells; i++) {
      gather(at.now[i], i);
      const CellMotion &c = at.now[i];
      states[i] = {c.at[P],        c.at[AT_X],     c.at[AT_Z],   c.at[P_RATE],         c.at[X_RATE],
                   c.at[Z_RATE],   c.contact.side, c.contact.w,  c.contact.r,          c.contact.step,
                   c.contact.root_scale, c.contact.rate_scale, c.contact.pace, c.power_step, c.size};
    }
    m.clock_high = clock.high, m.clock_low = clock.low;
  }
  void gather(CellMotion &c, int64_t i) const {
    for (int n = 0; n < NUMBERS; n++) c.at[n] = at.terms[0].of[n][i], c.at[n + NUMBERS] = at.terms[1].of[n][i];
  }

  // ---- Chain without contact forces

  // Gong et al. 2025, eq. 1, for the cells `first` to `last` (whole blocks). Computes out = share *
  // acceleration for the displacements q, the rates next * v, and the force `base` on the first m0.
  void accelerate(const Rows &q, const Rows &v, double next, double base, double share, const Rows &out, int64_t first,
                  int64_t last) {
    using Cells = Vector<BLOCK>;
    auto load = [](const double *from) { return Cells::load(from); };
    Cells x = load(q.of[AT_X] + first - BLOCK), vx = load(v.of[AT_X] + first - BLOCK);
    // Force of the link before each cell of a block. Neighbours are shifted in registers, because an
    // unaligned load that spans two recent stores would stall.
    auto links_of = [&](int64_t i) {
      Cells x_before = x, vx_before = vx;
      x = load(q.of[AT_X] + i), vx = load(v.of[AT_X] + i);
      return load(at.k0 + i) * (x - lanes_before(x_before, x)) +
             (next * load(at.c0 + i)) * (vx - lanes_before(vx_before, vx));
    };
    Cells links = links_of(first);
    if (first == 0) links.set(0, links[0] - base);
    for (int64_t i = first; i < last; i += BLOCK) {
      Cells z = load(q.of[AT_Z] + i), vz = load(v.of[AT_Z] + i);
      Cells pull = load(at.k2 + i) * (z - x) + (next * load(at.c2 + i)) * (vz - vx);
      Cells press = load(at.k1 + i) * load(q.of[P] + i) + (next * load(at.c1 + i)) * load(v.of[P] + i);
      Cells over2 = share * load(at.inverse2 + i), behind = links_of(i + BLOCK);
      (pull * over2 - press * (share * load(at.inverse_pair + i))).store(out.of[P] + i);
      ((pull - links + lanes_behind(links, behind)) * (share * load(at.inverse0 + i))).store(out.of[AT_X] + i);
      ((press - pull) * over2).store(out.of[AT_Z] + i);
      links = behind;
    }
  }

  void expand() {
    for (int k = 0; k + 2 < AHEAD; k++)
      accelerate(at.terms[k], at.terms[k + 1], k + 1.0, push[k], 1.0 / ((k + 1.0) * (k + 2.0)), at.terms[k + 2], 0,
                 at.padded);
  }

  // Computes displacements and rates `later` seconds after the window's start, without contact forces.
  void place(Rows (&there)[2], double later) const {
    using Cells = Vector<BLOCK>;
    for (int n = 0; n < NUMBERS; n++)
      for (int64_t i = 0; i < at.padded; i += BLOCK) {
        Cells value = Cells::load(at.terms[AHEAD - 1].of[n] + i), rate = (AHEAD - 1.0) * value;
        for (int k = AHEAD - 2; k > 0; k--) {
          Cells term = Cells::load(at.terms[k].of[n] + i);
          value = value * later + term, rate = rate * later + double(k) * term;
        }
        (value * later + Cells::load(at.terms[0].of[n] + i)).store(there[0].of[n] + i);
        rate.store(there[1].of[n] + i);
      }
  }

  // Adds sum_k A^k b M_k of the separately integrated cells, by Horner's scheme. A maps (q, v) to (v, v').
  void add_forces(Rows (&there)[2], const CellMotion *cells) {
    if (followed == 0) return;
    int64_t first = larger(int64_t(0), (at.busy[0] / BLOCK - 1) * BLOCK);
    int64_t last = smaller(at.padded, (at.busy[followed - 1] / BLOCK + 2) * BLOCK);
    for (Rows &each : at.heard)
      for (Row row : each.of)
        __builtin_memset(row + first - BLOCK, 0, size_t(last - first + 2 * BLOCK) * sizeof(double));
    int q = 0, v = 1, next = 2;
    for (int k = WINDOW_MOMENTS - 1; k >= 0; k--) {
      accelerate(at.heard[q], at.heard[v], 1.0, 0.0, 1.0, at.heard[next], first, last);
      for (int64_t n = 0; n < followed; n++) {
        int64_t i = at.busy[n];
        at.heard[next].of[P][i] -= at.inverse_pair[i] * cells[i].moments[k];
        at.heard[next].of[AT_Z][i] += at.inverse2[i] * cells[i].moments[k];
      }
      int free = q;
      q = v, v = next, next = free;
    }
    for (int order = 0; order < 2; order++)
      for (int n = 0; n < NUMBERS; n++)
        for (int64_t i = first; i < last; i++) there[order].of[n][i] += at.heard[order == 0 ? q : v].of[n][i];
  }

  // Computes the force of the base as a polynomial in the time from now. Returns how long it is valid [s].
  double place_push() {
    for (double &term : push) term = 0.0;
    int64_t pieces = m.pieces.size / PIECE_TERMS;
    if (pieces == 0) {
      Phasor term = m.drive.force * drive_later(0.0);
      for (int k = 0; k < AHEAD; k++) {
        push[k] = term.re;
        term = term * Phasor{0.0, 2.0 * PI * m.drive.frequency / (k + 1)};
      }
      return INFINITE;
    }
    double passed = -time_until(clock, m.piece_start);
    int64_t index = int64_t(smaller(double(pieces - 1), larger(0.0, passed / m.piece_length)));
    double left = time_until(clock, m.piece_start + double(index + 1) * m.piece_length);
    if (left <= ROUNDED_PIECE * m.piece_length && index + 1 < pieces) index++, left += m.piece_length;
    __builtin_memcpy(push, m.pieces.at + index * PIECE_TERMS, PIECE_TERMS * sizeof(double));
    shift(push, m.piece_length - left);
    return index + 1 < pieces ? left : INFINITE;
  }
  Phasor drive_later(double later) const {
    return turned_by(angle_at(clock.high, clock.low, later, m.drive.frequency)) * m.drive.start;
  }

  // ---- One window

  Outcome cross_window(double left) {
    double longest = smaller(left, place_push());
    expand();
    // After a window without separately integrated cells, the first try is a longer window (level -1).
    for (int level = followed == 0 ? -1 : 0; level < m.windows.size; level++) {
      full_length = smaller(longest, level < 0 ? IDLE_WINDOWS * m.windows.at[0] : m.windows.at[level]);
      place(at.end, full_length);
      if (!find_busy()) return NOT_FINITE;
      if (level < 0 ? followed == 0 : !neighbours_clash(int64_t(m.clashes.at[level]))) break;
    }
    for (int64_t n = 0; n < followed; n++) {
      CellMotion &begun = at.begun[at.busy[n]];
      gather(begun = at.now[at.busy[n]], at.busy[n]);
      for (double &moment : begun.moments) moment = 0.0;
    }
    int64_t impacts = m.impacts;
    double length = full_length;
    Outcome outcome = cross_cells(length);
    while (cut > 0.0) {
      length = cut, m.impacts = impacts;
      place(at.end, length);
      outcome = cross_cells(length);
    }
    if (outcome != REACHED_END) {
      // A cell failed within the window. Restore the motion at the window's start.
      for (int64_t n = 0; n < followed; n++) at.now[at.busy[n]] = at.begun[at.busy[n]];
      m.impacts = impacts;
      return outcome;
    }
    if (watches()) see_window(length);
    keep_samples(length);
    add_forces(at.end, at.now);
    for (int order = 0; order < 2; order++) {
      Rows swapped = at.terms[order];
      at.terms[order] = at.end[order], at.end[order] = swapped;
    }
    if (length >= left) clock = {m.until, 0.0, 0.0};
    else vibench::advance(clock, length);
    return outcome;
  }

  // Lists the cells that are in contact or may touch in this window. Returns false if the motion diverges.
  bool find_busy() {
    using Cells = Vector<BLOCK>;
    for (int what = P; what <= (watches() ? AT_X : P); what++)
      for (int64_t i = 0; i < at.padded; i += BLOCK) {
        Cells bound(0.0);
        for (int k = AHEAD - 1; k > 1; k--)
          bound = bound * full_length + (k * (k - 1.0)) * magnitude(Cells::load(at.terms[k].of[what] + i));
        bound.store(at.bounds[what] + i);
      }
    followed = 0;
    for (int64_t i = 0; i < at.cells; i++) {
      const Specimen &s = at.tables[kind_of(i)].tables.specimen;
      if (!(at.bounds[P][i] < LARGEST_BOUND)) return false;
      double margin = at.bounds[P][i] * full_length * full_length / 8.0;
      double low = margin - s.lower_gap, high = s.upper_gap - margin;
      double p = at.terms[0].of[P][i], end = at.end[0].of[P][i];
      bool is_clear = low < p && p < high && low < end && end < high;
      if (at.now[i].contact.side != 0.0 || s.law == POWERS || !is_clear) at.busy[followed++] = i;
    }
    return true;
  }
  bool neighbours_clash(int64_t distance) const {
    for (int64_t n = 1; n < followed; n++)
      if (at.busy[n] - at.busy[n - 1] <= distance) return true;
    return false;
  }

  Outcome cross_cells(double length) {
    Outcome worst = REACHED_END;
    cut = 0.0;
    for (int64_t n = 0; n < followed && cut == 0.0; n++) {
      int64_t i = at.busy[n];
      at.now[i] = at.begun[i];
      worst = larger(worst, cross(at.now[i], i, 0.0, length, Purpose::MOTION));
    }
    return worst;
  }

  // Updates the peaks of cells without contact, and adds contact forces of other cells to their lines.
  void see_window(double length) {
    Phasor end = conjugate(drive_later(length));
    for (int64_t i = 0, n = 0; i < at.cells; i++) {
      if (n < followed && at.busy[n] == i) {
        n++;
        if (m.watch != WATCH_PEAKS_AND_LINES) continue;
        Phasor sum{0.0, 0.0};
        for (int k = WINDOW_MOMENTS - 1; k >= 0; k--)
          sum = sum * Phasor{0.0, 2.0 * PI * m.drive.frequency} + Phasor{at.now[i].moments[k], 0.0};
        sum = sum * end;
        m.lines.at[2 * i] += sum.re, m.lines.at[2 * i + 1] += sum.im;
        continue;
      }
      for (int what = P; what <= AT_X; what++) {
        double &best = m.peaks.at[2 * i + (what == P)];
        double ends = larger(magnitude(at.terms[0].of[what][i]), magnitude(at.end[0].of[what][i]));
        if (ends + at.bounds[what][i] * length * length / 8.0 <= best) continue;
        double series[AHEAD];
        for (int k = 0; k < AHEAD; k++) series[k] = at.terms[k].of[what][i];
        // A window without contacts is twice as long and may contain two extremes: its halves are searched.
        best = series_peak(series_peak(best, series, 0.0, 0.5 * length), series, 0.5 * length, length);
      }
    }
  }

  // Computes samples by a second run of the separately integrated cells, which stops at each sample.
  void keep_samples(double length) {
    double reached = 0.0;
    int64_t room = m.samples.size / (6 * at.cells);
    for (; m.samples_kept < room; m.samples_kept++) {
      double later = time_until(clock, m.start + double(m.samples_kept) / m.sample_rate);
      if (later > length) return;
      place(at.sampled, later);
      for (int64_t n = 0; n < followed; n++)
        if (later > reached) cross(at.begun[at.busy[n]], at.busy[n], reached, later, Purpose::SAMPLE);
      add_forces(at.sampled, at.begun);
      reached = larger(reached, later);
      double *sample = m.samples.at + 6 * at.cells * m.samples_kept;
      for (int64_t i = 0; i < at.cells; i++, sample += 6)
        for (int order = 0; order < 2; order++) {
          double z = at.sampled[order].of[AT_Z][i];
          sample[X + 3 * order] = at.sampled[order].of[AT_X][i], sample[Z + 3 * order] = z;
          sample[Y + 3 * order] = at.sampled[order].of[P][i] + z;
        }
    }
  }

  // ---- One cell in a window

  // Computes the Taylor terms of the neighbours' force on a cell's m0, without contact forces in this window.
  void place_neighbours(double *force, int64_t i) const {
    const auto &link = at.tables[kind_of(i)].link;
    for (int k = 0; k < AHEAD; k++) {
      force[k] = i == 0 ? push[k] : 0.0;
      for (int side = 0; side < 2; side++) {
        int64_t neighbour = i + 2 * side - 1;
        double rate = k + 1 < AHEAD ? (k + 1) * at.terms[k + 1].of[AT_X][neighbour] : 0.0;
        force[k] += link[side][0] * at.terms[k].of[AT_X][neighbour] + link[side][1] * rate;
      }
    }
  }

  // Advances a cell within the window. Returns early if the window must be cut.
  Outcome cross(CellMotion &c, int64_t i, double from, double until, Purpose purpose) {
    KindTables &kind = at.tables[kind_of(i)];
    const Tables &t = kind.tables;
    const Specimen &s = t.specimen;
    double force[AHEAD], tau = from, shifted = 0.0;
    place_neighbours(force, i);
    age(c.moments, until - from);
    Record seen{};
    seen.watch = purpose == Purpose::MOTION && watches() ? WATCH_PEAKS : WATCH_NOTHING;
    seen.peak_x = m.peaks.at[2 * i], seen.peak_p = m.peaks.at[2 * i + 1];
    Observer observer{seen, t};
    Outcome outcome = REACHED_END;
    int touches = 0, stretches = 0;
    while (tau < until && outcome == REACHED_END) {
      if (++stretches > MOST_STRETCHES) return STALLED;
      if (tau > shifted) shift(force, tau - shifted), shifted = tau;
      double left = until - tau;
      if (s.law != POWERS && c.contact.side != 0.0 && (s.law != HERTZ || c.contact.w != 0.0)) {
        outcome = press(c, force, tau, until, t, observer);
        continue;
      }
      CellCourse course(c.at, force, t);
      if (s.law == POWERS) {
        double lasted = power_step(c, course, left, kind, observer);
        if (!(lasted > 0.0)) return NOT_FINITE;
        tau = lasted < left ? tau + lasted : until;
        continue;
      }
      if (c.contact.side != 0.0) {
        Collision<double> collision;
        double side = c.contact.side;
        if (!collide_cell(collision, c, course, left, m.tolerance, kind)) {
          outcome = press(c, force, tau, until, t, observer);
          continue;
        }
        if (observer.is_on())
          observer.see_shape(collision, gap_at(s, side), [&] {
            Vector<TERMS> terms;
            double factor = side;
            for (int k = 0; k < TERMS; k++, factor /= m.fastest) terms.set(k, factor * course[AT_X][k]);
            return terms;
          });
        tau += collision.duration;
        add_impulse(c, side, collision.duration, until - tau, TERMS, [&](int k) { return collision.moments[k]; });
        continue;
      }
      Room room{s.lower_gap, s.upper_gap, derivative_bound(course[P], left, 2), 0.0};
      for (int n = 0; n < NUMBERS; n++) room.reach += magnitude(c.at[n]) + left * magnitude(c.at[n + NUMBERS]);
      if (!(room.bound < LARGEST_BOUND)) return NOT_FINITE;
      double touches_at = first_contact(course[P], left, room), length = touches_at == NEVER ? left : touches_at;
      if (observer.is_on()) {
        seen.peak_x = course_peak(seen.peak_x, course[AT_X], length);
        if (seen.peak_p < larger(s.lower_gap, s.upper_gap)) seen.peak_p = course_peak(seen.peak_p, course[P], length);
      }
      course.place(c.at, length);
      if (touches_at == NEVER) break;
      tau += touches_at;
      if (++touches > MOST_TOUCHES) return TOO_MANY_IMPACTS;
      touch(c, touched_side(c.at[P], c.at[P_RATE], s), t);
      c.contact.w = 0.0;  // removes the rounding error: the penetration at a touch is zero
      if (purpose == Purpose::MOTION) {
        if (ends_too_late(c, tau, until, s)) {
          cut = tau;
          return REACHED_END;
        }
        if (m.impacts == m.impact_times.size) outcome = TOO_MANY_IMPACTS;
        else m.impact_cells.at[m.impacts] = double(i), m.impact_times.at[m.impacts++] = clock.high + tau;
      }
      if (until - tau <= HAIR * until) break;
    }
    if (observer.is_on()) m.peaks.at[2 * i] = seen.peak_x, m.peaks.at[2 * i + 1] = seen.peak_p;
    return outcome;
  }

  // Returns whether a collision from now would end after this window, but within a full window from now.
  bool ends_too_late(const CellMotion &c, double tau, double until, const Specimen &s) const {
    if (s.law != HERTZ || m.tolerance < LEAST_TOLERANCE || followed + at.cells / CELLS_AS_ONE > MOST_CUT) return false;
    if (!(SOON * until < tau && tau < until * (1.0 - HAIR))) return false;
    double lasts = LONGEST * c.contact.pace * c.contact.pace * c.contact.r;
    return until - tau <= lasts && lasts < full_length;
  }

  static void write(double *motion, const CellMotion &c) {
    for (int order = 0; order < 2; order++) {
      const double *from = c.at + NUMBERS * order;
      motion[X + 3 * order] = from[AT_X], motion[Z + 3 * order] = from[AT_Z];
      motion[Y + 3 * order] = from[P] + from[AT_Z];
    }
  }
  void touch(CellMotion &c, double side, const Tables &t) const {
    double motion[6];
    write(motion, c);
    begin_contact(c.contact, motion, side, step_tolerance(), t);
  }

  // Adds a force that ended `ago` seconds before `cross` ends; moment(k) is its integral times (1 - s)^k.
  template <class Moment>
  void add_impulse(CellMotion &c, double side, double length, double ago, int count, const Moment &moment) const {
    double added[WINDOW_MOMENTS] = {}, factor = side * length;
    for (int k = 0; k < count; k++) {
      added[k] = factor * moment(k);
      factor *= length * (1.0 / (k + 1));
    }
    age(added, ago);
    for (int k = 0; k < WINDOW_MOMENTS; k++) c.moments[k] += added[k];
  }

  Outcome press(CellMotion &c, const double *force, double &tau, double until, const Tables &t,
                Observer &observer) const {
    const Specimen &s = t.specimen;
    auto with = [&](const auto &law) { return press_on(c, law, force, tau, until, t, observer); };
    if (s.law == HERTZ) return with(HertzForce{s.contact_stiffness});
    return with(YieldingForce{s.linear_stiffness, s.contact_stiffness, s.loss});
  }
  template <class Force>
  Outcome press_on(CellMotion &c, const Force &law, const double *force, double &tau, double until, const Tables &t,
                   Observer &observer) const {
    double series[AHEAD], motion[6], side = c.contact.side, limit = until - tau, reached = 0.0;
    __builtin_memcpy(series, force, sizeof series);
    shift(series, 0.5 * limit);
    BaseForce base(0.5 * limit, series);
    write(motion, c);
    auto seen = [&](const auto &steps, double h) {
      if (observer.is_on()) observer.see_step(steps, h, c.contact);
      add_step(c, steps, h, limit);
    };
    ContactEnd end = advance_contact(c.contact, motion, reached, limit, base, law, step_tolerance(), t, seen);
    for (int order = 0; order < 2; order++)
      c.at[AT_X + NUMBERS * order] = motion[X + 3 * order], c.at[AT_Z + NUMBERS * order] = motion[Z + 3 * order];
    c.at[P] = side * (gap_at(t.specimen, side) + c.contact.w * c.contact.w);
    c.at[P_RATE] = side * c.contact.r;
    tau = end == ContactEnd::HELD ? until : tau + reached;
    if (end == ContactEnd::LOST) return NOT_FINITE;
    return end == ContactEnd::STALLED ? STALLED : REACHED_END;
  }

  // Adds the integrals of F (limit - t)^k / k! dt over the step, with dt = w ds, from the stages.
  template <class Steps> static void add_step(CellMotion &c, const Steps &steps, double h, double limit) {
    for (int j = 0; j < STAGES; j++) {
      if (END_WEIGHTS[j] == 0.0) continue;
      double w = steps.stages[j][TIME], r = 2.0 * steps.stages[j][W], passed = 0.0;
      for (int i = 0; i < j; i++) passed += STAGE_WEIGHTS[j][i] * steps.stages[i][TIME];
      double left = limit - (steps.point[TIME] + h * passed);
      double share = steps.rates.side * h * END_WEIGHTS[j] * w * steps.rates.force(w, r);
      for (int k = 0; k < WINDOW_MOMENTS; k++) {
        c.moments[k] += share;
        share *= left * (1.0 / (k + 1));
      }
    }
  }

  // Takes one step under a power law. Returns its length, or zero after a failure.
  double power_step(CellMotion &c, const CellCourse &course, double left, KindTables &kind,
                    Observer &observer) const {
    const Tables &t = kind.tables;
    double wish = c.power_step > 0.0 ? c.power_step : full_length, length = smaller(wish, left), misfit = INFINITE;
    double p = c.at[P], outward = larger(p >= 0.0 ? c.at[P_RATE] : -c.at[P_RATE], 0.0);
    CellStep step{kind, *m.power_shapes, course, 0.0, {}, {}, {}, {}};
    for (int n = 0; n < MOST_TRIES && !(misfit <= 1.0); n++) {
      if (n > 0) length *= SHORTER_STEP;
      while (length * kind.power.stiffest_rate(magnitude(p) + outward * length, 0.0, t.inverse_pair) > WALL_TURN)
        length *= SHORTER_STEP;
      step.length = length;
      misfit = step.attempt(c, fit_tolerance(m.tolerance, kind.tables.specimen));
    }
    if (!(misfit <= 1.0)) return 0.0;
    bool is_fine = misfit < TRY_LONGER;
    if (length < left || is_fine) c.power_step = length * (is_fine ? LONGER_STEP : 1.0);
    if (observer.is_on()) {
      observer.record.peak_x = step.peak(observer.record.peak_x, AT_X, c);
      observer.record.peak_p = step.peak(observer.record.peak_p, P, c);
    }
    add_impulse(c, 1.0, length, left - length, WINDOW_MOMENTS, [&](int k) { return step.moments[k]; });
    for (int n = 0; n < 2 * NUMBERS; n++) c.at[n] = step.after[n];
    c.size = larger(magnitude(c.at[P]), CELL_FADING * c.size);
    return length;
  }
};

}  // namespace vibench
