// Tests of the engine in a C++ program, which can run with the sanitizers of g++:
//
//     g++ -std=c++20 -O1 -g -fsanitize=address,undefined native/test_engine.cpp -o test_engine && ./test_engine FILE ...
//
// tests/sim/engine/test_native_program.py writes each FILE: the bytes of Scene, CollisionShapes, PowerShapes.
#include "api.cpp"

#include <cmath>
#include <cstdio>
#include <vector>

namespace {

int failures = 0;

void expect(bool holds, const char *what, double found) {
  if (holds) return;
  std::printf("FAILED: %s (%.3g)\n", what, found);
  failures++;
}

// Returns a uniform number in [low, high) from a linear congruential generator, the same on every system.
double draw(double low, double high) {
  static uint64_t state = 1;
  state = state * 6364136223846793005u + 1442695040888963407u;
  return low + (high - low) * double(state >> 11) * 0x1p-53;
}

double units_in_last_place(double found, double exact) {
  return std::fabs(found - exact) / (std::nextafter(std::fabs(exact), INFINITY) - std::fabs(exact));
}

void test_elementary_functions_are_those_of_libm() {
  double worst_exp = 0, worst_log = 0, worst_turn = 0, worst_root = 0;
  for (int n = 0; n < 200000; n++) {
    double x = draw(-700, 700);
    worst_exp = std::fmax(worst_exp, units_in_last_place(exponential(x), std::exp(x)));
    double angle = n % 2 ? draw(-1e5, 1e5) : draw(-7, 13);
    auto [cosine, sine] = cosine_sine(angle);
    worst_turn = std::fmax(worst_turn, units_in_last_place(cosine, std::cos(angle)));
    worst_turn = std::fmax(worst_turn, units_in_last_place(sine, std::sin(angle)));
    worst_log = std::fmax(worst_log, units_in_last_place(logarithm(std::exp(x)), std::log(std::exp(x))));
    double y = std::exp(x), root = fifth_root(y);
    worst_root = std::fmax(worst_root, std::fabs(root * root * root * root * root / y - 1));
  }
  expect(worst_exp <= 1.5, "exp is right to 1.5 units in the last place", worst_exp);
  expect(worst_log <= 1.0, "ln is right to one unit in the last place", worst_log);
  expect(logarithm(0) == -INFINITY && logarithm(INFINITY) == INFINITY && logarithm(1) == 0, "ln at its ends", 0);
  expect(std::isnan(logarithm(-1)) && std::isnan(logarithm(NAN)), "ln of what has none", 0);
  expect(std::fabs(logarithm(4e-320) / std::log(4e-320) - 1) < 1e-15, "ln of a subnormal", 0);
  expect(worst_turn <= 1.5, "sine and cosine are right to 1.5 units in the last place", worst_turn);
  expect(worst_root <= 3e-15, "the fifth root is right to rounding", worst_root);
  expect(exponential(0) == 1 && exponential(-INFINITY) == 0, "exp at its ends", 0);
  expect(exponential(INFINITY) == INFINITY && std::isnan(exponential(NAN)), "exp of what is no number", 0);
  expect(std::isnan(cosine_sine(NAN).cosine) && std::isnan(cosine_sine(INFINITY).sine), "no angle has no cosine", 0);
  expect(fifth_root(0) == 0 && fifth_root(INFINITY) == INFINITY, "the fifth root at its ends", 0);
  expect(std::fabs(fifth_root(4e-320) / std::pow(4e-320, 0.2) - 1) < 1e-3, "the fifth root of a subnormal", 0);
}

void test_products_keep_what_they_round_off() {
  for (int n = 0; n < 1000; n++) {
    double a = draw(1, 1000), b = draw(0, 1e6), product = a * b;
    expect(product_error(a, b, product) == std::fma(a, b, -product), "product_error is exact", a);
  }
}

// Uses parabolas with an exactly known peak at either stop, and bounds larger than necessary.
void test_no_touch_is_missed_and_none_is_seen_before_the_gap_has_closed() {
  constexpr double GAP = 45e-6, LENGTH = 4e-5;
  for (int n = 0; n < 20000; n++) {
    double side = n % 2 ? 1.0 : -1.0, bend = std::exp(draw(std::log(10.0), std::log(5e4))), at = draw(1e-6, LENGTH);
    Room room{n % 3 || side < 0 ? GAP : INFINITE, n % 3 || side > 0 ? GAP : INFINITE, draw(1, 30) * bend, GAP};
    double over = std::exp(draw(std::log(1e-16), std::log(1e-7)));
    auto touch = [&](double peak) {
      double series[AHEAD] = {side * (peak - 0.5 * bend * at * at), side * bend * at, -0.5 * side * bend};
      return first_contact(series, LENGTH, room);
    };
    double before = std::sqrt(2 * over / bend), found = touch(GAP + over);
    if (before < at) {
      expect(found > 0 && found <= at - before + 1e-14, "a touch is found where the gap closes", found);
      double early = 0.5 * bend * ((at - found) * (at - found) - before * before);
      expect(early < 2e-16, "a touch is not called before the gap has closed", early);
    }
    expect(touch(GAP - larger(over, 1e-15)) == NEVER, "a peak short of the stop is no touch", over);

    double speed = std::exp(draw(std::log(1e-6), 0)), pull = 1e5, back = 2 * speed / pull;
    double leaving[AHEAD] = {side * GAP, -side * speed, 0.5 * side * pull};
    found = first_contact(leaving, LENGTH, {GAP, GAP, draw(1, 10) * pull, GAP});
    if (back < 0.999 * LENGTH && speed * speed / (2 * pull) < GAP)
      expect(std::fabs(found - back) * speed < 1e-16 + 1e-9 * back * speed, "a stop that was left is met again", found);
    else if (back > 1.001 * LENGTH && speed * LENGTH - 0.5 * pull * LENGTH * LENGTH < GAP)
      expect(found == NEVER, "a stop that is being left is no touch", found);
  }
  double across[AHEAD] = {0.5 * GAP, -10.0};
  double far = first_contact(across, LENGTH, {GAP, GAP, 1.0, GAP});
  expect(std::fabs(far - 0.15 * GAP) < 1e-15, "the far stop is watched", far);
}

// first_touch uses Newton's method where p provably has no extreme. It must agree with the full search.
void test_a_touch_is_the_one_that_the_careful_search_finds() {
  constexpr double GAP = 45e-6, LENGTH = 4e-5;
  const double lowest_gaps[] = {GAP, 0.3 * GAP, INFINITE};
  for (int n = 0; n < 20000; n++) {
    // Rotating terms as in a flight: each derivative is at most the fastest rate times the derivative before.
    double series[AHEAD] = {}, bound = 0.0, reach = GAP, lowest = lowest_gaps[n % 3], length = draw(0.05, 1) * LENGTH;
    for (int term = 0; term < 3; term++) {
      double rate = LONGEST_TURN / LENGTH * draw(0.05, 1), size = 2 * GAP * draw(0, 1), phase = draw(0, 2 * PI);
      double factor = size;
      for (int k = 0; k < AHEAD; k++) {
        series[k] += factor * std::cos(phase + 0.5 * PI * k);
        factor *= rate / (k + 1);
      }
      bound += size * rate * rate, reach += size;
    }
    series[0] = smaller(GAP, larger(-lowest, draw(-1, 1) * GAP));
    series[1] += draw(-3, 3) * GAP / LENGTH;
    Room room{lowest, GAP, bound, reach};
    double careful = first_contact(series, length, room), quick = first_touch(series, length, room);
    if (careful == NEVER || quick == NEVER) {
      // At the end of a stretch, one search may find a touch that the other finds in the next stretch.
      expect(careful == quick || std::fmax(careful, quick) > length * (1 - 1e-9), "both find a touch", careful - quick);
      continue;
    }
    double slope = std::fabs(polynomial_at(series, careful).rate);
    expect(std::fabs(quick - careful) * slope < 2e-16 + 2e-15 * slope, "both find the same touch", quick - careful);
  }
}

double worst_of_products(const double (&rows)[6][6], int count, const Metric &metric) {
  double worst = 0.0;
  for (int i = 0; i < count; i++)
    for (int j = 0; j < count; j++) worst = std::fmax(worst, std::fabs(inner(rows[i], rows[j], metric) - (i == j)));
  return worst;
}

void test_changes_become_orthonormal_and_a_lost_one_is_replaced() {
  Metric metric = {};
  for (int i = 0; i < 6; i++) metric[i][i] = draw(0.5, 100);
  for (int i = 1; i < 6; i++) metric[i][i - 1] = metric[i - 1][i] = draw(-0.3, 0.3);
  for (int n = 0; n < 1000; n++) {
    double rows[6][6], size = std::exp(draw(-14, 14)), logarithms[6] = {}, volume[6] = {};
    for (auto &row : rows)
      for (double &number : row) number = size * draw(-1, 1);
    double first = std::sqrt(inner(rows[0], rows[0], metric));
    orthonormalise(rows, 6, metric, logarithms);
    expect(worst_of_products(rows, 6, metric) < 1e-12, "rows are orthonormal", n);
    expect(std::fabs(logarithms[0] - std::log(first)) < 1e-13, "a length is kept as its logarithm", n);
    orthonormalise(rows, 6, metric, volume);
    for (double each : volume) expect(std::fabs(each) < 1e-12, "orthonormal rows do not change", each);
  }
  double rows[6][6] = {{1, 2, 3}, {-2, -4, -6}, {0, 1, 0}}, logarithms[6] = {};
  orthonormalise(rows, 3, metric, logarithms);
  expect(logarithms[1] == -INFINITY && std::isfinite(logarithms[0] + logarithms[2]), "a row is lost", logarithms[1]);
  expect(worst_of_products(rows, 3, metric) < 1e-12, "a lost row is replaced", 0);
}

void test_lanes_go_their_own_ways_by_masks() {
  Lanes x, y;
  for (int n = 0; n < LANES; n++) x.set(n, draw(-1, 1)), y.set(n, draw(-1, 1));
  x.set(3, NAN);
  unsigned below = (x < y).bits();
  Lanes chosen = select(x < y, x, 2.0 * y), sizes = magnitude(y), sum = fused(x, y, 0.5);
  for (int n = 0; n < LANES; n++) {
    expect(((below >> n) & 1) == unsigned(x[n] < y[n]), "a mask has the bits of its comparisons", n);
    expect(chosen[n] == (x[n] < y[n] ? x[n] : 2 * y[n]), "a lane chooses by its own bit", n);
    expect(sizes[n] == std::fabs(y[n]), "magnitudes", n);
    expect(n == 3 || std::fabs(sum[n] - (x[n] * y[n] + 0.5)) < 1e-15, "fused products", sum[n]);
  }
  expect((Mask::of(0b1010) & ~Mask::of(0b0010)).bits() == 0b1000, "masks are combined bit by bit", 0);
}

void test_short_series_are_cosine_and_sine() {
  for (double angle = -1.6; angle < 1.6; angle += 0.01) {
    LanePhasor turned = turned_by_series<LONG>(angle);
    expect(std::fabs(turned.re[0] - std::cos(angle)) < 1e-14, "cosine by its series", angle);
    expect(std::fabs(turned.im[0] - std::sin(angle)) < 1e-14, "sine by its series", angle);
  }
}

void test_polynomials_of_collisions_are_sums_of_their_monomials() {
  static double coefficients[COEFFICIENTS];
  Lanes variables[VARIABLES], values[POLYNOMIALS];
  for (double &coefficient : coefficients) coefficient = draw(-1, 1);
  for (Lanes &variable : variables)
    for (int n = 0; n < LANES; n++) variable.set(n, draw(-1, 1));
  evaluate(values, variables, coefficients);
  for (int lane = 0; lane < LANES; lane++)
    for (int n = 0; n < POLYNOMIALS; n++) {
      double sum = 0;
      for (int k = 0; k < THE_MONOMIALS.counts[n]; k++) {
        double monomial = coefficients[THE_MONOMIALS.first[n] + k];
        for (int i = 0; i < VARIABLES; i++) monomial *= std::pow(variables[i][lane], THE_MONOMIALS.of[k].powers[i]);
        sum += monomial;
      }
      expect(std::fabs(values[n][lane] - sum) < 1e-13, "a polynomial is the sum of its monomials", values[n][lane] - sum);
    }
}

void test_a_stage_that_ran_away_is_never_an_accepted_step() {
  for (double size : {1e80, 1e155, 1e200, 1e300, double(INFINITY), double(NAN)})
    for (int stage = 5; stage < STAGES; stage++) {
      double stages[STAGES][1] = {};
      stages[stage][0] = size;
      StepError error;
      error.add(stages, 0, 1e-10);
      double found = error.of_step(1e-6, 2.0);
      expect(!(found <= 1.0) && step_factor(found) < 1.0, "a stage ran away", size);
    }
}

void test_an_impact_keeps_momentum_and_places_and_turns_the_approach(const Body &paper) {
  for (int n = 0; n < 1000; n++) {
    Body body = paper;
    Specimen &s = body.specimen;
    s.lower_gap = 20e-6, s.upper_gap = 50e-6, s.restitution = n % 5 ? draw(0.01, 1) : 0.0;
    double side = n % 2 ? 1.0 : -1.0, vz = draw(-1, 1), approach = draw(1e-3, 1);
    const double begin[6] = {1e-5, 3e-5 + side * gap_at(s, side), 3e-5, draw(-1, 1), vz + side * approach, vz};
    double at[6], moved = 0;
    __builtin_memcpy(at, begin, sizeof at);
    rebound(at, side, closed_gap(1e-4, s), 1e-6, body);
    for (int i = 0; i < 4; i++) moved = std::fmax(moved, std::fabs(at[i] - begin[i]));
    expect(moved < 1e-16, "an impact leaves places and m0 alone", moved);
    double gained = s.m1 * (at[VY] - begin[VY]) + s.m2 * (at[VZ] - begin[VZ]);
    expect(std::fabs(gained) < 1e-17, "an impact keeps momentum", gained);
    double off = side * (at[VY] - at[VZ]) + s.restitution * approach;
    expect(std::fabs(off) < 1e-12, "an impact turns the approach by the restitution", off);
  }
}

Motion<double> at_rest() { return {}; }

// A run of `until` seconds from a given motion, and what was observed.
struct HarmonicRun {
  const Tables &tables;
  double until;
  Record *seen = nullptr;

  template <class T> Outcome operator()(Motion<T> &motion, double tolerance) const {
    std::vector<double> times(100000);
    Record record{};
    record.impact_times = times.data(), record.impact_room = int64_t(times.size()), record.steps_left = MOST_STEPS;
    if (seen != nullptr) record.watch = WATCH_PEAKS_AND_LINES;
    place_on_its_side(motion, tolerance, tables);
    Outcome outcome = with_stops(motion, tables, tolerance, record, [&](auto &run) { return run.advance(until); });
    if (seen != nullptr) *seen = record;
    return outcome;
  }
};

struct RunOnCubics {
  const CubicTables &tables;
  double omega, until;

  template <class T> Outcome operator()(Motion<T> &motion, double tolerance) const {
    Record record{};
    record.impact_room = INT64_MAX, record.steps_left = MOST_STEPS;
    place_on_its_side(motion, tolerance, tables);
    return with_cubic_stops(motion, tables, tolerance, record, [&](auto &run) {
      for (int n = 0; n * tables.interval < until; n++) {
        double h = tables.interval, turn = omega * h, angle = n * turn, u = 20e-6 * std::sin(angle);
        double v = 20e-6 * omega * std::cos(angle), next = 20e-6 * std::sin(angle + turn);
        double w = 20e-6 * omega * std::cos(angle + turn), mean = (next - u) / h;
        const double base[CUBIC] = {u, v, (3 * mean - 2 * v - w) / h, (v + w - 2 * mean) / (h * h)};
        Outcome outcome = run.advance(base, 0.0, h);
        if (outcome != REACHED_END) return outcome;
      }
      return REACHED_END;
    });
  }
};

// Compares derivatives by dual numbers with central differences of two neighbouring runs.
template <class RunTo> void test_duals_are_derivatives(const RunTo &run_to, double tolerance) {
  const double scale[6] = {1e-4, 1e-4, 1e-4, 0.1, 0.1, 0.1};
  constexpr double STEP = 1e-6;
  Motion<double> plain = at_rest();
  run_to(plain, tolerance);
  for (int k = 0; k < 6; k++) {
    Motion<Dual<double, 1>> motion{};
    motion.at[k].slope[0] = scale[k];
    expect(run_to(motion, tolerance) == REACHED_END, "a run of duals reaches its end", k);
    for (int i = 0; i < 6; i++)
      expect(plain.at[i] == motion.at[i].value, "duals move as plain numbers do", plain.at[i] - motion.at[i].value);
    Motion<double> ahead = at_rest(), behind = at_rest();
    ahead.at[k] = STEP * scale[k], behind.at[k] = -STEP * scale[k];
    run_to(ahead, 1e-10);
    run_to(behind, 1e-10);
    double size = 0, worst = 0;
    for (int i = 0; i < 6; i++) {
      double exact = (ahead.at[i] - behind.at[i]) / (2 * STEP) / scale[i];
      size = std::fmax(size, std::fabs(exact));
      worst = std::fmax(worst, std::fabs(motion.at[i].slope[0] / scale[i] - exact));
    }
    expect(worst <= 1e-4 * size, "slopes are derivatives of the flow", worst / size);
  }
}

// The fit covers no collision, so every contact is integrated in steps, as in a run at a strict tolerance.
void test_motions_of_a_batch_are_those_of_runs(const Tables &tables) {
  constexpr int64_t COUNT = 11, PERIODS = 9;
  constexpr double TOLERANCE = 9e-8;  // at this tolerance no collision is solved as a whole
  static CollisionFit fit;
  for (int k = 0; k < VARIABLES; k++) fit.middle[k] = 1e9, fit.half[k] = 1.0;
  fit.unit = 1.0;
  std::vector<State> states(COUNT);
  std::vector<double> sections(COUNT * PERIODS * 6);
  std::vector<BatchMotion> motions(COUNT);
  std::vector<Record> records(COUNT);
  std::vector<double> growth(COUNT * PERIODS);
  std::vector<int64_t> struck(COUNT * PERIODS);
  const Tangent begun{1, {{1e-3, 2e-3, 3e-3, 0.4, 0.5, 0.6}}, {}};
  std::vector<Tangent> tangents(COUNT, begun);
  for (int64_t n = 0; n < COUNT; n++) {
    states[n] = {};
    states[n].motion[VX] = 1e-3 * double(n);
    records[n].watch = WATCH_PEAKS_AND_LINES;
    Record *record = n == 4 ? nullptr : &records[n];
    motions[n] = {&tables, &states[n], &sections[n * PERIODS * 6], 1 + n % PERIODS, 0, 0, record,
                  n % 3 == 0 ? nullptr : &tangents[n], &growth[n * PERIODS], &struck[n * PERIODS]};
  }
  Batch batch{motions.data(), COUNT, &fit, TOLERANCE, {}};
  for (int i = 0; i < 6; i++) batch.metric[i][i] = i < 3 ? 1e6 : 1.0;
  expect(vibench_follow_batch(&batch) == REACHED_END, "a batch is accepted", 0);
  int64_t impacts = 0;
  for (int64_t n = 0; n < COUNT; n++) {
    expect(motions[n].outcome == REACHED_END, "a motion of a batch comes to its end", double(n));
    Motion<double> alone = at_rest();
    alone.at[VX] = 1e-3 * double(n);
    Record seen{};
    HarmonicRun{tables, double(motions[n].periods) / tables.drive.frequency, &seen}(alone, TOLERANCE);
    for (int i = 0; i < 6; i++) {
      double off = (states[n].motion[i] - alone.at[i]) / (i < 3 ? 1e-4 : 0.1);
      expect(std::fabs(off) < 1e-8, "a motion of a batch is that of a run", off);
    }
    if (motions[n].record == nullptr) seen = {};
    const Record &found = records[n];
    for (double off : {found.peak_x - seen.peak_x, found.peak_p - seen.peak_p})
      expect(std::fabs(off) <= 1e-8 * seen.peak_p, "peaks of a batch are those of a run", off);
    for (Phasor off : {found.line_x - seen.line_x, found.line_p - seen.line_p})
      expect(magnitude(off) <= 1e-7 * magnitude(seen.line_x), "lines of a batch are those of a run", magnitude(off));
    impacts += motions[n].impacts;
    if (motions[n].tangent == nullptr) continue;
    State state{};
    state.motion[VX] = 1e-3 * double(n);
    Record unseen{};
    unseen.steps_left = MOST_STEPS;
    std::vector<double> times(1000);
    unseen.impact_times = times.data(), unseen.impact_room = 1000;
    Tangent change = begun;
    double end = double(motions[n].periods) / tables.drive.frequency;
    expect(vibench_run(&tables, &state, end, TOLERANCE, &unseen, &change) == REACHED_END, "a run", 0);
    double square = inner(change.rows[0], change.rows[0], batch.metric);
    for (int i = 0; i < 6; i++) {
      double scaled = std::exp(tangents[n].growth[0] - change.growth[0]) * tangents[n].rows[0][i];
      double off = (scaled - change.rows[0][i]) * square_root(batch.metric[i][i] / square);
      expect(std::fabs(off) < 1e-6, "a tangent vector of a batch is that of a run", off);
    }
    double length = 0.5 * std::log(square) + change.growth[0];
    double off = growth[n * PERIODS + motions[n].periods - 1] - length;
    expect(std::fabs(off) < 1e-6, "growth in a batch is that of a run", off);
    expect(struck[n * PERIODS + motions[n].periods - 1] == motions[n].impacts, "impacts are counted", double(n));
  }
  expect(impacts > COUNT, "motions of the batch strike their stops", double(impacts));
}

}  // namespace

int main(int count, char **names) {
  test_elementary_functions_are_those_of_libm();
  test_products_keep_what_they_round_off();
  test_no_touch_is_missed_and_none_is_seen_before_the_gap_has_closed();
  test_a_touch_is_the_one_that_the_careful_search_finds();
  test_changes_become_orthonormal_and_a_lost_one_is_replaced();
  test_lanes_go_their_own_ways_by_masks();
  test_short_series_are_cosine_and_sine();
  test_polynomials_of_collisions_are_sums_of_their_monomials();
  test_a_stage_that_ran_away_is_never_an_accepted_step();
  for (int n = 1; n < count; n++) {
    Scene scene;
    CollisionShapes shapes;
    PowerShapes power_shapes;
    std::FILE *file = std::fopen(names[n], "rb");
    bool is_read = file != nullptr && std::fread(&scene, sizeof scene, 1, file) == 1 &&
                   std::fread(&shapes, sizeof shapes, 1, file) == 1 &&
                   std::fread(&power_shapes, sizeof power_shapes, 1, file) == 1;
    if (file != nullptr) std::fclose(file);
    expect(is_read, "a scene can be read", n);
    if (!is_read) continue;
    scene.collisions = &shapes, scene.power_shapes = &power_shapes;
    std::vector<double> memory(size_t(vibench_size_of_tables(scene.specimen.law)) / sizeof(double));
    const Tables &tables = *reinterpret_cast<Tables *>(memory.data());
    expect(vibench_prepare(&scene, reinterpret_cast<Tables *>(memory.data())) == REACHED_END, "a scene is accepted", n);
    int before = failures;
    test_an_impact_keeps_momentum_and_places_and_turns_the_approach(tables);
    CubicScene cubic{scene.specimen, 5e-5, LONGEST_TURN / tables.flight.grid, scene.power, &power_shapes};
    std::vector<double> more(size_t(vibench_size_of_cubic_tables(scene.specimen.law)) / sizeof(double));
    CubicTables &cubics = *reinterpret_cast<CubicTables *>(more.data());
    expect(vibench_prepare_cubics(&cubic, &cubics) == REACHED_END, "a scene of cubics is accepted", n);
    for (double tolerance : {3e-7, 1e-10}) test_duals_are_derivatives(HarmonicRun{tables, 0.03}, tolerance);
    test_duals_are_derivatives(RunOnCubics{cubics, tables.omega, 0.025}, 1e-8);
    if (scene.specimen.law == HERTZ) test_motions_of_a_batch_are_those_of_runs(tables);
    if (failures > before) std::printf("in %s\n", names[n]);
  }
  std::printf(failures > 0 ? "%d checks failed\n" : "all checks passed\n", failures);
  return failures > 0;
}
