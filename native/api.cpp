// The C interface, with plain numbers only. No function throws, allocates memory, or keeps state between
// calls, so threads may share tables. Every function checks its arguments, and refuses them by a return code.
#include "batch.hpp"
#include "chain.hpp"
#include "cubic.hpp"
#include "filters.hpp"
#include "run.hpp"
#include "world.hpp"

#if defined(_WIN32)
#define VIBENCH_API extern "C" __declspec(dllexport)
#else
#define VIBENCH_API extern "C" __attribute__((visibility("default")))
#endif

using namespace vibench;

namespace {

constexpr double LATEST = 1e12;  // largest time [s]
constexpr int64_t MOST_PARTS = 1000000;  // largest number of parts of an interval between two readings

bool is_positive(double x) { return x > 0.0 && is_finite(x); }
bool is_not_negative(double x) { return x >= 0.0 && is_finite(x); }
bool is_finite_phasor(const Phasor &x) { return is_finite(x.re) && is_finite(x.im); }

bool is_usable(const LinearMotion &motion) {
  if (motion.modes < 1 || motion.modes > MODES) return false;
  for (int j = 0; j < int(motion.modes); j++) {
    if (!is_finite_phasor(motion.rates[j])) return false;
    for (int i = 0; i < 6; i++)
      if (!is_finite_phasor(motion.shapes[j][i]) || !is_finite_phasor(motion.rows[j][i])) return false;
  }
  for (const Phasor &steady : motion.steady)
    if (!is_finite_phasor(steady)) return false;
  return true;
}

bool is_usable(const Specimen &s) {
  const double positive[] = {s.m0, s.m1, s.m2, s.k0, s.k1, s.k2};
  for (double number : positive)
    if (!is_positive(number)) return false;
  const double not_negative[] = {s.c0, s.c1, s.c2, s.linear_stiffness, s.contact_stiffness, s.loss};
  for (double number : not_negative)
    if (!is_not_negative(number)) return false;
  if (!(s.lower_gap > 0.0 && s.upper_gap > 0.0) || s.law < 0 || s.law >= LAWS) return false;
  if (s.law == HERTZ && !(s.contact_stiffness > 0.0)) return false;
  if (s.law == YIELDING && !(s.contact_stiffness + s.linear_stiffness > 0.0)) return false;
  return s.restitution >= 0.0 && s.restitution <= 1.0;
}

bool is_usable(const PowerTerms &law) {
  if (!is_positive(law.reference) || law.terms < 1 || law.terms > MOST_POWERS) return false;
  int64_t previous = 1;
  for (int i = 0; i < int(law.terms); i++) {
    bool is_odd_and_higher = law.exponents[i] % 2 == 1 && law.exponents[i] > previous && law.exponents[i] <= 1001;
    if (!is_odd_and_higher || !is_positive(law.forces[i])) return false;
    previous = law.exponents[i];
  }
  return true;
}

bool is_usable(const Scene &scene) {
  const Specimen &s = scene.specimen;
  if (!is_usable(s) || !is_usable(scene.flight) || !is_positive(scene.drive.frequency)) return false;
  if (!is_finite_phasor(scene.drive.start) || !is_finite_phasor(scene.drive.force)) return false;
  if (s.law == HERTZ && scene.collisions == nullptr) return false;
  if (s.law == POWERS && (scene.power_shapes == nullptr || !is_usable(scene.power))) return false;
  return (s.law != SPRINGS && s.law != RIGID) || is_usable(scene.held.motion);
}

bool is_usable(const Record &record) {
  bool has_samples = record.sample_room == 0 || (record.samples != nullptr && is_positive(record.sample_rate));
  return has_samples && record.samples_kept >= 0 && record.samples_kept <= record.sample_room &&
         record.impacts >= 0 && record.impacts <= record.impact_room && record.steps_left >= 0 &&
         record.steps_left <= MOST_STEPS && is_finite(record.start) && record.watch >= 0 && record.watch < WATCHES;
}

bool is_usable(const Tangent &tangent) {
  if (tangent.changes < 1 || tangent.changes > 6) return false;
  for (const auto &row : tangent.rows)
    for (double number : row)
      if (!is_finite(number)) return false;
  return true;
}

bool is_usable(const Readings &readings) {
  bool has_room = readings.room == 0 || (readings.growth != nullptr && readings.impacts != nullptr &&
                                         readings.motions != nullptr);
  for (int i = 0; i < 6; i++)
    if (!is_positive(readings.metric[i][i])) return false;
  return has_room && readings.made >= 0 && readings.made <= readings.room && readings.parts > 0 &&
         readings.parts <= MOST_PARTS && is_positive(readings.interval) && readings.interval * double(readings.room) < LATEST;
}

bool is_tolerance(double tolerance) { return tolerance > 0.0 && tolerance < 1.0; }

// Builds the `Run` for the specimen's law, and returns the result of `act` with it.
template <class T, class Act>
Outcome with_stops(Motion<T> &motion, const Tables &t, double tolerance, Record &record, const Act &act) {
  auto with = [&](const auto &stops) {
    Run run(motion, t, stops, tolerance, record);
    return act(run);
  };
  const Specimen &s = t.specimen;
  switch (s.law) {
    case NO_STOPS: return with(WithoutStops{});
    case HERTZ: return with(HertzStops{{HertzForce{s.contact_stiffness}}});
    case YIELDING: return with(YieldingStops<YieldingForce>{{s.linear_stiffness, s.contact_stiffness, s.loss}});
    case SPRINGS: return with(SpringStops{});
    case RIGID: return with(HardStops{});
    case POWERS: {
      PowerRun<T> run(motion, t, tolerance, record);
      return act(run);
    }
    default: return REFUSED;
  }
}

bool is_usable(const State &state, double until, double tolerance) {
  return is_tolerance(tolerance) && magnitude(until) < LATEST && magnitude(state.clock_high) < LATEST &&
         is_finite(state.clock_low) && (state.side == 0.0 || magnitude(state.side) == 1.0) &&
         state.level >= 0.0 && state.level <= LEVELS;
}

// Compiled three times: without tangent vectors, for one, which is faster, and for up to six.
Outcome advance(State &state, Tangent *tangent, const Tables &tables, double until, double tolerance,
                Record &record) {
  auto with = [&](auto motion) {
    Outcome outcome = with_stops(motion, tables, tolerance, record, [&](auto &run) { return run.advance(until); });
    keep(state, values_of(motion));
    if (tangent != nullptr) keep_changes(*tangent, motion);
    return outcome;
  };
  if (tangent == nullptr) return with(motion_of(state));
  if (tangent->changes == 1) return with(with_changes<1>(motion_of(state), *tangent));
  return with(with_changes<6>(motion_of(state), *tangent));
}

#define DESCRIBED(Name) {Name##_text, sizeof(Name)}
constexpr struct {
  const char *text;
  int64_t size;
} STRUCTURES[] = {
    DESCRIBED(Specimen), DESCRIBED(LinearMotion), DESCRIBED(HeldMotion), DESCRIBED(Drive),
    DESCRIBED(CollisionShapes), DESCRIBED(PowerTerms), DESCRIBED(PowerShapes), DESCRIBED(Scene), DESCRIBED(CubicScene),
    DESCRIBED(State), DESCRIBED(Record), DESCRIBED(Numbers), DESCRIBED(CubicDrive), DESCRIBED(Tangent),
    DESCRIBED(Readings),
    // Batches
    DESCRIBED(CollisionMonomials), DESCRIBED(CollisionFit), DESCRIBED(BatchMotion), DESCRIBED(Batch),
    // Signals, analogue part of the virtual rig, hidden-state estimation, chains
    DESCRIBED(Interpolation), DESCRIBED(Decimation), DESCRIBED(RecursiveFilter),
    DESCRIBED(FilteredSignal), DESCRIBED(Sensor), DESCRIBED(Controller), DESCRIBED(LoadedShaker), DESCRIBED(LoopCables),
    DESCRIBED(TrackedStop), DESCRIBED(TrackRecord), DESCRIBED(MotionFilter), DESCRIBED(MotionSmoother),
    DESCRIBED(ContactSearch),
    DESCRIBED(CellKind), DESCRIBED(CellState), DESCRIBED(ChainMotion),
};
constexpr int64_t STRUCTURE_COUNT = sizeof STRUCTURES / sizeof *STRUCTURES;

}  // namespace

// Return the source text and the size of a structure. A structure follows the structures that it contains.
VIBENCH_API const char *vibench_structure(int64_t index) {
  return index >= 0 && index < STRUCTURE_COUNT ? STRUCTURES[index].text : nullptr;
}
VIBENCH_API int64_t vibench_size_of(int64_t index) {
  return index >= 0 && index < STRUCTURE_COUNT ? STRUCTURES[index].size : 0;
}
// Returns the size of the tables for a `Law` [bytes].
VIBENCH_API int64_t vibench_size_of_tables(int64_t law) {
  return sizeof(Tables) + (law == POWERS ? sizeof(PowerTables) : 0);
}

// Fills `tables`, which has vibench_size_of_tables(law) bytes. The scene's shapes must outlive the tables.
VIBENCH_API int64_t vibench_prepare(const Scene *scene, Tables *tables) {
  if (scene == nullptr || tables == nullptr || !is_usable(*scene)) return REFUSED;
  fill_tables(*tables, *scene);
  if (scene->specimen.law == POWERS) {
    PowerTables *power = reinterpret_cast<PowerTables *>(tables + 1);
    fill_power_tables(*power, *scene, tables->flight, tables->omega);
    tables->power = power;
  }
  return REACHED_END;
}

// Determines whether the motion in `state` starts on a stop, and fills the other members of `state`.
VIBENCH_API int64_t vibench_start(const Body *tables, State *state, double tolerance) {
  if (tables == nullptr || state == nullptr || !is_tolerance(tolerance)) return REFUSED;
  Motion<double> motion = motion_of(*state);
  place_on_its_side(motion, tolerance, *tables);
  keep(*state, motion);
  return REACHED_END;
}

// Advances `state` and its tangent vectors, if any, to the time `until` [s], and fills `record`. Returns an
// `Outcome`.
VIBENCH_API int64_t vibench_run(const Tables *tables, State *state, double until, double tolerance, Record *record,
                                Tangent *tangent) {
  if (tables == nullptr || state == nullptr || record == nullptr) return REFUSED;
  if (!is_usable(*state, until, tolerance) || !is_usable(*record)) return REFUSED;
  if (tangent != nullptr && !is_usable(*tangent)) return REFUSED;
  return advance(*state, tangent, *tables, until, tolerance, *record);
}

// Advances `state` and `tangent`, and stores the growth up to reading `last`. Returns an `Outcome`.
VIBENCH_API int64_t vibench_take_readings(const Tables *tables, State *state, double tolerance, Record *record,
                                          Tangent *tangent, Readings *readings, int64_t last) {
  if (tables == nullptr || state == nullptr || record == nullptr || tangent == nullptr || readings == nullptr)
    return REFUSED;
  if (!is_usable(*state, 0.0, tolerance) || !is_usable(*record) || !is_usable(*tangent)) return REFUSED;
  if (!is_usable(*readings) || last > readings->room) return REFUSED;
  return take_readings(*state, *record, *tangent, *readings, last, [&](double until) {
    return advance(*state, tangent, *tables, until, tolerance, *record);
  });
}

// Returns a bound of |p| until the next touch [m]: the sum of the phasors' magnitudes. Infinite in contact.
VIBENCH_API double vibench_reach(const Tables *tables, const State *state) {
  if (tables == nullptr || state == nullptr || state->side != 0.0) return INFINITE;
  Clock<double> clock{state->clock_high, state->clock_low, 0.0};
  Phasor phasors[PHASORS];
  start_flight(phasors, state->motion, drive_phasor(clock, 0.0, *tables), tables->flight);
  return PhasorSum<PHASORS>(phasors, tables->flight.path, tables->flight).reach;
}

// ---- Motions on a base whose displacement is a cubic on each interval

namespace {

constexpr double MOST_PIECES = 1e15;  // largest number of pieces of an interval

bool is_lent(const Numbers &numbers) { return numbers.size == 0 || (numbers.size > 0 && numbers.at != nullptr); }
bool has_size(const Numbers &numbers, int64_t size) { return is_lent(numbers) && numbers.size == size; }
bool has_columns(const Numbers &numbers, int64_t columns) {
  return is_lent(numbers) && columns > 0 && numbers.size % columns == 0;
}
bool is_table(const Numbers &numbers, int64_t rows, int64_t columns) {
  return has_columns(numbers, columns) && numbers.size / columns == rows;
}
bool is_count(int64_t count, int64_t most) { return count >= 0 && count <= most; }

bool is_usable(const CubicScene &scene) {
  if (!is_usable(scene.specimen) || !is_positive(scene.interval) || !is_positive(scene.fastest)) return false;
  if (!(scene.interval * scene.fastest < MOST_PIECES)) return false;
  return scene.specimen.law != POWERS || (scene.power_shapes != nullptr && is_usable(scene.power));
}

bool is_usable(const CubicDrive &drive, double interval) {
  int64_t intervals = drive.base.size / CUBIC, kept = drive.impacts.size;
  return has_columns(drive.base, CUBIC) && is_count(drive.done, intervals) && drive.first_from >= 0.0 &&
         drive.first_from <= interval && drive.last_to >= 0.0 && drive.last_to <= interval * (2.0 - ALMOST) &&
         is_lent(drive.impacts) && is_table(drive.motions, kept, 6) && (kept == 0 || kept == intervals);
}

}  // namespace

// Returns the size of the tables for a `Law` on a base of cubics [bytes].
VIBENCH_API int64_t vibench_size_of_cubic_tables(int64_t law) {
  return sizeof(CubicTables) + (law == POWERS ? sizeof(CubicPowerTables) : 0);
}

// Fills `tables`, which has vibench_size_of_cubic_tables(law) bytes. The scene's shapes must outlive them.
VIBENCH_API int64_t vibench_prepare_cubics(const CubicScene *scene, CubicTables *tables) {
  if (scene == nullptr || tables == nullptr || !is_usable(*scene)) return REFUSED;
  bool has_powers = scene->specimen.law == POWERS;
  fill_cubic_tables(*tables, has_powers ? reinterpret_cast<CubicPowerTables *>(tables + 1) : nullptr, *scene);
  return REACHED_END;
}

// Advances `state` over the intervals of `drive`, and counts impacts in `record`. Returns an `Outcome`.
VIBENCH_API int64_t vibench_run_cubics(const CubicTables *tables, State *state, CubicDrive *drive, double tolerance,
                                       Record *record) {
  if (tables == nullptr || state == nullptr || drive == nullptr || record == nullptr) return REFUSED;
  if (!is_usable(*state, 0.0, tolerance) || !is_usable(*record) || !is_usable(*drive, tables->interval)) return REFUSED;
  if (record->watch != WATCH_NOTHING) return REFUSED;
  Motion<double> motion = motion_of(*state);
  Outcome outcome = with_cubic_stops(motion, *tables, tolerance, *record, [&](auto &run) {
    return follow(run, motion, *drive, tables->interval, *record);
  });
  record->steps_left = larger<int64_t>(record->steps_left, 0);
  keep(*state, motion);
  return outcome;
}

// ---- Functions of one structure: batches, signals, analogue part, hidden-state estimation, chains

namespace {

constexpr int64_t MOST_MOTIONS = int64_t(1) << 32;  // largest number of motions of a batch
constexpr int64_t MOST_PERIODS = int64_t(1) << 32;  // largest number of drive periods of a motion in a batch
constexpr int64_t LAST_STEP = int64_t(1) << 60;  // largest step number in the analogue part
constexpr int64_t MOST_SMALL_STEPS = 100000;
constexpr int FLOW_SIZE = sizeof(StepFlow) / sizeof(double);
constexpr int STOP_SIZE = sizeof(TrackedStop) / sizeof(double);

bool is_usable(const Interpolation &of) {
  return has_columns(of.samples, of.channels) && has_columns(of.table, INTERPOLATION_TAPS) &&
         of.table.size >= 4 * INTERPOLATION_TAPS && is_lent(of.positions) &&
         is_table(of.values, of.positions.size, of.channels);
}

bool is_usable(const Decimation &of) {
  return is_lent(of.means) && of.reach % 8 == 0 && has_columns(of.table, of.reach) && of.table.size > 0 &&
         is_lent(of.samples) && is_count(of.first, LAST_STEP) &&
         is_positive(of.ratio) && is_finite(of.begin) && magnitude(double(of.origin)) < double(LAST_STEP);
}

bool is_usable(const CollisionMonomials &of) {
  return is_table(of.powers, MONOMIALS, VARIABLES) && has_size(of.counts, POLYNOMIALS);
}

bool is_usable(const CollisionFit &fit) {
  for (double number : fit.coefficients)
    if (!is_finite(number)) return false;
  for (double number : fit.guess)
    if (!is_finite(number)) return false;
  for (int k = 0; k < VARIABLES; k++)
    if (!is_finite(fit.middle[k]) || !is_positive(fit.half[k])) return false;
  return is_positive(fit.unit);
}

bool is_usable(const BatchMotion &motion, const Specimen &specimen, double tolerance) {
  if (motion.tables == nullptr || motion.now == nullptr || motion.sections == nullptr) return false;
  if (__builtin_memcmp(&motion.tables->specimen, &specimen, sizeof specimen) != 0) return false;
  if (motion.tables->flight.modes != DRIVEN || motion.now->side != 0.0) return false;
  for (double number : motion.now->motion)
    if (!is_finite(number)) return false;
  if (motion.record != nullptr && !is_usable(*motion.record)) return false;
  if (const Tangent *of = motion.tangent; of != nullptr)
    if (!is_usable(*of) || of->changes != 1 || motion.growth == nullptr || motion.struck == nullptr) return false;
  return motion.periods > 0 && motion.periods <= MOST_PERIODS && is_usable(*motion.now, 0.0, tolerance);
}

bool is_usable(const Batch &batch) {
  if (!is_count(batch.count, MOST_MOTIONS) || batch.motions == nullptr || batch.fit == nullptr) return false;
  if (!is_usable(*batch.fit) || batch.count == 0) return batch.count == 0;
  const Tables *first = batch.motions->tables;
  if (first == nullptr || first->specimen.law != HERTZ) return false;
  if (!is_finite(first->specimen.lower_gap) || !is_finite(first->specimen.upper_gap)) return false;
  for (int64_t n = 0; n < batch.count; n++)
    if (!is_usable(batch.motions[n], first->specimen, batch.tolerance)) return false;
  return true;
}

bool is_usable(const RecursiveFilter &filter) {
  int64_t order = filter.state.size;
  return order > 0 && is_lent(filter.state) && has_size(filter.numerator, order) && has_size(filter.denominator, order);
}

bool is_usable(const FilteredSignal &of) {
  return is_usable(of.filter) && is_lent(of.values) && has_size(of.result, of.values.size);
}

bool is_usable(const Sensor &sensor) {
  int64_t steps = sensor.motion.size;
  return is_usable(sensor.filter) && is_lent(sensor.motion) && has_size(sensor.noise, steps) &&
         has_size(sensor.volts, steps) && (sensor.instead.size == 0 || has_size(sensor.instead, steps));
}

bool is_usable(const LoadedShaker &s) {
  constexpr int64_t NUMBER = sizeof(double), ENDS = 9;
  const CubicTables *tables = reinterpret_cast<const CubicTables *>(s.tables.at);
  if (!is_lent(s.tables) || s.tables.size * NUMBER < int64_t(sizeof(CubicTables))) return false;
  if (s.tables.size * NUMBER != vibench_size_of_cubic_tables(tables->specimen.law)) return false;
  int64_t steps = s.drive.size;
  return is_usable(s.specimen, 0.0, s.tolerance) && is_positive(s.step) && is_lent(s.drive) &&
         has_size(s.noise, steps) && has_size(s.amplifier_voltage, steps) && has_size(s.base_acceleration, steps) &&
         has_size(s.m0_velocity, steps) && has_columns(s.ends, ENDS) && s.ends.size / ENDS <= steps &&
         is_lent(s.begun) && (s.begun.size == 0 || s.block > 0);
}

bool is_usable(const LoopCables &loop) {
  const Controller *c = loop.controller;
  if (c == nullptr || !is_count(c->harmonics, MOST_HARMONICS) || !is_count(c->remembered, MOST_MEMORY)) return false;
  int64_t steps = loop.drive.size;
  return is_usable(loop.base) && is_usable(loop.m0) && is_lent(loop.drive) && loop.base.motion.size == steps &&
         loop.m0.motion.size == steps && is_count(loop.first, LAST_STEP) && is_count(loop.begin, steps) &&
         is_lent(loop.late) && loop.steps_per_sample > 0 && loop.steps_per_sample <= loop.late.size;
}

bool is_stepped(double step, int64_t small_steps) {
  return is_positive(step) && small_steps > 0 && small_steps <= MOST_SMALL_STEPS;
}

bool has_samples(const TrackRecord &record, int64_t samples) {
  return is_table(record.states, samples, TRACKED) && is_table(record.covariances, samples, TRACKED * TRACKED) &&
         is_table(record.innovations, samples, 2) && has_size(record.kinds, samples) &&
         is_table(record.jacobians, samples, TRACKED * TRACKED) && has_size(record.impulses, samples);
}

bool is_usable(const MotionFilter &f) {
  if (!is_lent(f.velocity) || !is_lent(f.state) || !is_count(f.state.size, MOST_STATES)) return false;
  int64_t samples = f.velocity.size, states = f.state.size, parameters = states - TRACKED;
  if (parameters < 0) return false;
  bool is_kept = f.record.states.size > 0;
  return has_size(f.acceleration, samples + 1) && is_table(f.flows, 1 + parameters, FLOW_SIZE) &&
         is_table(f.small_flows, 1 + parameters, FLOW_SIZE) && is_table(f.stops, 1 + parameters, STOP_SIZE) &&
         has_size(f.deviations, parameters) && is_stepped(f.step, f.small_steps) &&
         is_table(f.noise, states, states) && has_size(f.force_variance, samples) &&
         has_size(f.force_input, TRACKED) && is_table(f.covariance, states, states) &&
         has_samples(f.record, is_kept ? samples : 0) && !(is_kept && parameters > 0);
}

bool is_usable(const MotionSmoother &s) {
  int64_t samples = s.record.kinds.size, forces = s.force_variance.size;
  return has_samples(s.record, samples) && has_size(s.flow, FLOW_SIZE) && has_size(s.force_input, TRACKED) &&
         is_lent(s.force_variance) && (forces == 0 || forces == samples) && is_table(s.states, samples, TRACKED) &&
         is_table(s.variances, samples, 2) && is_table(s.forces, forces, 2) && has_size(s.matrix, TRACKED * TRACKED);
}

bool is_usable(const ContactSearch &of) {
  return is_lent(of.touched) && is_table(of.states, of.touched.size, TRACKED) && is_lent(of.acceleration) &&
         has_size(of.small_flow, FLOW_SIZE) && has_size(of.stop, STOP_SIZE) && is_stepped(of.step, of.small_steps) &&
         of.longest > 0 && has_columns(of.contacts, CONTACT_COLUMNS);
}

constexpr int KIND_SIZE = sizeof(CellKind) / sizeof(double);
constexpr int CELL_SIZE = sizeof(CellState) / sizeof(double);
constexpr int64_t MOST_CELLS = 1000000, MOST_WINDOWS = int64_t(1) << 50;

int64_t chain_memory(int64_t cells, int64_t kinds) { return ChainMemory(nullptr, cells, kinds).used; }

bool is_usable(const CellKind &kind, const ChainMotion &chain) {
  const Specimen &s = kind.specimen;
  if (!is_usable(s) || s.law == RIGID) return false;
  if (s.law == HERTZ && chain.collisions == nullptr) return false;
  if (s.law == POWERS && (chain.power_shapes == nullptr || !is_usable(kind.power))) return false;
  return is_not_negative(kind.next_stiffness) && is_not_negative(kind.next_damping);
}

bool has_cells(const ChainMotion &chain) {
  int64_t cells = chain.kind_of.size, kinds = chain.kinds.size / KIND_SIZE;
  if (!has_columns(chain.kinds, KIND_SIZE) || !is_lent(chain.kind_of) || cells < 1 || cells > MOST_CELLS) return false;
  if (kinds < 1 || kinds > cells || !is_table(chain.states, cells, CELL_SIZE)) return false;
  for (int64_t k = 0; k < kinds; k++)
    if (!is_usable(reinterpret_cast<const CellKind *>(chain.kinds.at)[k], chain)) return false;
  for (int64_t i = 0; i < cells; i++) {
    const CellState &cell = reinterpret_cast<const CellState *>(chain.states.at)[i];
    bool has_kind = chain.kind_of.at[i] >= 0.0 && chain.kind_of.at[i] < double(kinds);
    bool has_side = cell.side == 0.0 || magnitude(cell.side) == 1.0;
    if (!has_kind || !has_side || !is_not_negative(cell.power_step) || !is_not_negative(cell.size)) return false;
  }
  return has_size(chain.memory, chain_memory(cells, kinds));
}

bool has_windows(const ChainMotion &chain) {
  if (!is_lent(chain.windows) || chain.windows.size < 1 || !has_size(chain.clashes, chain.windows.size)) return false;
  for (int64_t level = 0; level < chain.windows.size; level++) {
    double window = chain.windows.at[level], clash = chain.clashes.at[level];
    if (!is_positive(window) || !(window * chain.fastest <= LONGEST_WINDOW)) return false;
    if (!(clash >= 0.0 && clash < double(MOST_CELLS))) return false;
  }
  return is_positive(chain.fastest) && is_count(chain.windows_left, MOST_WINDOWS);
}

bool is_usable(const ChainMotion &chain) {
  int64_t cells = chain.kind_of.size;
  if (!has_cells(chain) || !has_windows(chain) || !is_tolerance(chain.tolerance)) return false;
  bool has_clock = magnitude(chain.until) < LATEST && magnitude(chain.clock_high) < LATEST &&
                   is_finite(chain.clock_low);
  bool has_drive = is_positive(chain.drive.frequency) && is_finite_phasor(chain.drive.start) &&
                   is_finite_phasor(chain.drive.force);
  bool has_pieces = has_columns(chain.pieces, PIECE_TERMS) &&
                    (chain.pieces.size == 0 || (is_positive(chain.piece_length) && is_finite(chain.piece_start)));
  bool has_samples = has_columns(chain.samples, 6 * cells) &&
                     is_count(chain.samples_kept, chain.samples.size / (6 * cells)) && is_finite(chain.start) &&
                     (chain.samples.size == 0 || is_positive(chain.sample_rate));
  bool has_impacts = is_lent(chain.impact_times) && has_size(chain.impact_cells, chain.impact_times.size) &&
                     is_count(chain.impacts, chain.impact_times.size);
  bool has_watch = chain.watch >= 0 && chain.watch < WATCHES;
  bool has_sums = is_table(chain.peaks, cells, 2) && is_table(chain.lines, cells, 2);
  return has_clock && has_drive && has_pieces && has_samples && has_impacts && has_watch && has_sums;
}

// Determines which cells of a chain start on a stop.
int64_t start_chain(ChainMotion &chain) {
  ChainRun(chain).start();
  return REACHED_END;
}
int64_t follow_chain(ChainMotion &chain) { return ChainRun(chain).advance(); }

}  // namespace

// Advances shaker and controller over the remaining steps of `loop`. Returns a `LoopEnd`, or REFUSED.
VIBENCH_API int64_t vibench_close_loop(LoopCables *loop) {
  if (loop == nullptr || loop->shaker == nullptr || !is_usable(*loop) || !is_usable(*loop->shaker)) return REFUSED;
  if (loop->shaker->drive.at != loop->drive.at || loop->shaker->drive.size != loop->drive.size) return REFUSED;
  return close_loop(*loop);
}

// Returns the size of the memory that a chain needs [doubles].
VIBENCH_API int64_t vibench_chain_memory(int64_t cells, int64_t kinds) {
  bool is_chain = cells > 0 && cells <= MOST_CELLS && kinds > 0 && kinds <= cells;
  return is_chain ? chain_memory(cells, kinds) : int64_t(REFUSED);
}

// Defines vibench_NAME, which returns the result of NAME, or REFUSED for unusable arguments.
#define OF_ONE_STRUCTURE(function, Structure)                                 \
  VIBENCH_API int64_t vibench_##function(Structure *of) {                     \
    return of != nullptr && is_usable(*of) ? function(*of) : int64_t(REFUSED); \
  }
OF_ONE_STRUCTURE(describe_collisions, CollisionMonomials)
OF_ONE_STRUCTURE(follow_batch, Batch)
OF_ONE_STRUCTURE(interpolate, Interpolation)
OF_ONE_STRUCTURE(decimate, Decimation)
OF_ONE_STRUCTURE(filter_signal, FilteredSignal)
OF_ONE_STRUCTURE(show, Sensor)
OF_ONE_STRUCTURE(move_shaker, LoadedShaker)
OF_ONE_STRUCTURE(play_loop, LoopCables)
OF_ONE_STRUCTURE(hear_loop, LoopCables)
OF_ONE_STRUCTURE(filter_motion, MotionFilter)
OF_ONE_STRUCTURE(smooth_motion, MotionSmoother)
OF_ONE_STRUCTURE(follow_contacts, ContactSearch)
OF_ONE_STRUCTURE(start_chain, ChainMotion)
OF_ONE_STRUCTURE(follow_chain, ChainMotion)
