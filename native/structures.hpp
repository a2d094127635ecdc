// Structures of the C interface. STRUCTURE declares a C++ structure and keeps its source text, from which
// `vibench.sim.engine` builds the Python structure. Members may be double, int64_t, Phasor, structures
// declared above, arrays, and pointers.
#pragma once
#include "scalar.hpp"

#define STRUCTURE(Name, ...)          \
  struct Name {                       \
    __VA_ARGS__                       \
  };                                  \
  inline constexpr char Name##_text[] = #Name " { " #__VA_ARGS__ " }";

namespace vibench {

struct Tables;  // defined in tables.hpp

constexpr int MOST_POWERS = 6;  // terms of a power law

// Indices of a motion: absolute displacements [m] and velocities [m/s] of m0, m1, m2.
enum { X, Y, Z, VX, VY, VZ };

// Kind of the stops; `Specimen::law`.
enum Law : int64_t {
  NO_STOPS,
  HERTZ,     // eq. 2, no loss
  YIELDING,  // (linear_stiffness d + contact_stiffness d^(3/2)) (1 + loss dd/dt) at the penetration d
  SPRINGS,   // linear_stiffness d, solved exactly by the modes of the specimen in contact
  RIGID,
  POWERS,    // sum of odd powers of p, which acts at every p; see `PowerTerms`
  LAWS,
};

// How a run ended, with the values of `vibench.sim.specimen.Outcome`; negative for refused arguments.
enum Outcome : int64_t {
  REFUSED = -1,
  REACHED_END,
  TOO_MANY_IMPACTS,
  NOT_FINITE,
  STALLED,
  TOO_LONG,
};

// Gong et al. 2025, eqs. 1 and 2: masses, springs, dampers, clearances, and the stops' parameters.
STRUCTURE(Specimen,
  double m0, m1, m2;           // [kg]
  double k0, k1, k2;           // [N/m]
  double c0, c1, c2;           // [N s/m]
  double lower_gap;            // clearance at negative p [m]; infinite without a stop
  double upper_gap;            // clearance at positive p [m]
  int64_t law;                 // one of `Law`
  double linear_stiffness;     // of stops that are springs [N/m]
  double contact_stiffness;    // k_contact of eq. 2 [N/m^1.5]
  double loss;                 // of Hunt and Crossley [s/m]
  double restitution;          // of rigid stops, 0 to 1
)

// A linear motion: s(t) = Re sum_j a_j shapes_j exp(rates_j t), with a_j = rows_j . s(0). Each conjugate pair
// and each real rate is one mode. `steady` is the steady motion per unit phasor of the drive.
STRUCTURE(LinearMotion,
  int64_t modes;               // 2 to 6
  Phasor rates[6];             // [1/s]
  Phasor shapes[6][6];
  Phasor rows[6][6];
  Phasor steady[6];
)

// m1 on a rigid or spring stop: a linear motion about another rest position.
STRUCTURE(HeldMotion,
  LinearMotion motion;
  Phasor pulls[7];             // quantity that keeps m1 on the stop, per unit phasor; the last for the drive
  double let_go;               // constant part of this quantity, over the gap
  double rests;                // constant part of |p|, over the gap
)

// U(t) = A0 sin(2 pi f t + phase): the drive's phasor is exp(i (2 pi f t + phase)).
STRUCTURE(Drive,
  double frequency;            // [Hz]
  Phasor start;                // the phasor at time zero
  Phasor force;                // k0 U + c0 dU/dt = Re(force phasor) [N]
)

// Precomputed Hertz collisions (decision 0008), the same for every specimen; `vibench.sim.engine` computes them.
STRUCTURE(CollisionShapes,
  double shares[8][16][16];    // [m][k][i]: integral up to point i of (t_i - t)^m of a unit value at point k
  double ends[16][8];          // [k][m]: the same integral up to the end
  double weights[16];          // weights of the points in an integral over the duration
  double heights[16];          // times of the points, over the duration
  double about_middle[16][8];  // contribution of a depth at a point to the Taylor terms about the middle
  double shapes[41][23][16];   // for each press; rows as in `ShapeRow`
  double durations[41][7];     // for each press; columns as in `DurationColumn`
)

// F = sum forces_i (p / reference)^exponents_i at every p: the continuous model of the stops (eq. 3).
STRUCTURE(PowerTerms,
  double reference;            // [m]
  int64_t terms;               // 1 to 6
  int64_t exponents[6];        // odd, ascending, from 3
  double forces[6];            // [N]
)

// Coefficients of Gauss points on a step from 0 to 1, for every law. `vibench.sim.engine` computes them.
STRUCTURE(PowerShapes,
  double points[8], weights[8];
  double shares[32][8][8];     // [m][k][i]: integral up to point i of (c_i - s)^m of a unit value at point k
  double ends[32][8];          // [m][k]: the same integral up to the end
  double at_start[8], at_end[8];  // value of the polynomial at start and end per value at each point
  double course[9][8];         // coefficients of powers of (s - 1) per value at a point; the last at the end
  double point_weights[8];     // barycentric, of the points alone
  double instants[10], instant_weights[10], instant_slopes[10];  // of start, points and end; barycentric too
)

// A specimen on a base whose displacement is a cubic on each of equal intervals.
STRUCTURE(CubicScene,
  Specimen specimen;
  double interval;             // [s]
  double fastest;              // fastest rate of the specimen without stops [1/s]
  PowerTerms power;            // for the law POWERS
  const PowerShapes *power_shapes;
)

// Observed quantities of a run; `Record::watch`.
enum Watch : int64_t {
  WATCH_NOTHING,
  WATCH_PEAKS,
  WATCH_PEAKS_AND_LINES,
  WATCHES,
};

STRUCTURE(Scene,
  Specimen specimen;
  Drive drive;
  LinearMotion flight;
  HeldMotion held;             // for SPRINGS and RIGID; no modes for other laws
  PowerTerms power;            // for the law POWERS
  const CollisionShapes *collisions;
  const PowerShapes *power_shapes;
)

// State of a motion, in flight or in contact.
STRUCTURE(State,
  double motion[6];            // x, y, z, vx, vy, vz [m, m/s]
  double clock_high, clock_low;  // time is their exact sum [s]
  double side;                 // +1 or -1 while m1 is on the stop at positive or negative p; 0 in flight
  double root;                 // w: the square root of the penetration [m^0.5]
  double rate;                 // r = d|p|/dt [m/s]
  double step;                 // the next step in s, where dt = w ds [s/m^0.5]
  double root_scale;           // expected largest w [m^0.5]
  double rate_scale;           // expected largest r [m/s]
  double pace;                 // ratio of expected largest w and r [s/m^0.5]
  double level;                // under a power law: level of the next step, plus one; 0 before the first step
  double sizes[3];             // under a power law: recent sizes of p, x, z [m]
)

// Results of a run, which do not influence its steps.
STRUCTURE(Record,
  double start;                // time of sample 0 [s]
  double sample_rate;          // [Hz]
  double *samples;             // [sample_room][6]
  int64_t sample_room, samples_kept;
  double *impact_times;        // [impact_room]; a run ends when the array is full
  int64_t impact_room, impacts;
  int64_t steps_left;          // remaining steps of the run
  int64_t watch;               // one of `Watch`
  double peak_x, peak_p;       // largest |x| and |p| [m]
  Phasor line_x, line_p;       // integrals of x and p times exp(-i (omega t + phase)) [m s]
)

// An array passed for one call. Before any access its size is checked against those of related arrays.
STRUCTURE(Numbers,
  double *at;
  int64_t size;
)

// Consecutive intervals with U = c0 + c1 tau + c2 tau^2 + c3 tau^3 on each, and the motion at their ends.
STRUCTURE(CubicDrive,
  Numbers base;                // [intervals][4]: c0 ... c3 [m, m/s, m/s^2, m/s^3]
  double first_from, last_to;  // start of the run in the first interval, and end in the last one [s]
  int64_t done;                // number of finished intervals
  Numbers motions;             // [intervals][6]: x, y, z, vx, vy, vz at the end of each; or empty
  Numbers impacts;             // [intervals]: number of impacts in each; or empty
)

// Small changes of a motion, integrated with it: exact directional derivatives of the motion.
STRUCTURE(Tangent,
  int64_t changes;             // 1 to 6
  double rows[6][6];           // x, y, z, vx, vy, vz of each change
  double growth[6];            // logarithm of the factor removed from each row
)

// Readings of the growth of small changes, which are made orthonormal in a metric at equal intervals.
STRUCTURE(Readings,
  double interval;             // [s]; reading k is due at (k + 1) interval
  int64_t parts;               // parts of an interval, after each of which changes are made orthonormal
  double metric[6][6];
  double *growth;              // [room][changes]: logarithm of the growth factor of each change
  int64_t *impacts;            // [room]: number of impacts in each interval
  double *motions;             // [room][6]: x, y, z, vx, vy, vz at the end of each interval
  int64_t room, made;
)

// ---- Batches: motions of one specimen, eight at a time

// Monomials of the polynomials in `CollisionFit`, which Python needs for the fit.
STRUCTURE(CollisionMonomials,
  Numbers powers;              // [289][6]: powers of the variables, sorted by contribution
  Numbers counts;              // [6]: number of leading monomials of each polynomial
)

// Hertz collisions of one specimen as polynomials (decision 0061).
STRUCTURE(CollisionFit,
  double coefficients[652];    // of the duration over u, then of the moments
  double middle[6], half[6];   // centre and half range of the fitted variables
  double unit;                 // u times the fifth root of the speed [s (m/s)^(1/5)]
  double guess[4];             // first guess of speed^(-1/5): a cubic in speed^(1/4), highest power first
)

// One motion of a batch.
STRUCTURE(BatchMotion,
  const Tables *tables;
  State *now;                  // a flight at a whole drive period; advanced unless the motion fails
  double *sections;            // [periods][6]: x, y, z, vx, vy, vz once per drive period
  int64_t periods;             // number of periods to simulate
  int64_t impacts;             // number of contacts
  int64_t outcome;             // REACHED_END; or TOO_LONG or STALLED, then the motion must be simulated alone
)

STRUCTURE(Batch,
  BatchMotion *motions;        // [count], of one specimen with Hertz's stops and three oscillating modes
  int64_t count;
  const CollisionFit *fit;     // of that specimen
  double tolerance;            // relative error of a contact step outside the polynomials' range
)

// ---- Signals

// Values of band-limited signals between their samples.
STRUCTURE(Interpolation,
  Numbers samples;             // [channels][samples of one]; zero outside
  int64_t channels;
  Numbers table;               // [phases + 3][64]: taps, from one phase before a sample to one past the next
  Numbers positions;           // in samples after the first
  Numbers values;              // [channels][positions]: the result
)

// Samples at a lower rate, each a weighted sum of `reach` means over equal steps.
STRUCTURE(Decimation,
  Numbers means;
  int64_t reach;               // a multiple of eight
  Numbers table;               // [rows][reach]: weights for fractions 0 to 1 of a step, or only one row
  double ratio;                // steps per sample
  double begin;                // time of the last sample before number 0 [steps]
  int64_t origin;              // index of the oldest mean of a sample, minus the whole steps of its time
  int64_t first;               // number of the first sample
  Numbers samples;             // the result
)

// A recursive digital filter (direct form II, transposed) that keeps its state from call to call.
STRUCTURE(RecursiveFilter,
  Numbers numerator;           // coefficients; the first is for the present value
  Numbers denominator;         // coefficients; the first is 1
  Numbers state;               // the last number stays zero
)

STRUCTURE(FilteredSignal,
  RecursiveFilter filter;
  Numbers values;
  Numbers result;
)

// ---- The analogue world of the virtual rig

// Conversion of a motion into the voltage of a sensor, over some steps.
STRUCTURE(Sensor,
  RecursiveFilter filter;
  Numbers noise;               // [steps], in units of the motion
  Numbers instead;             // [steps], in the same units: replaces the motion except at NaN; or empty
  double full_scale;           // in units of the motion
  double full_scale_voltage;   // [V]
  Numbers motion;              // [steps]: mean over each step
  Numbers volts;               // [steps]: the result
)

// A real-time controller. Its output is a Fourier series of its phase plus the output of a linear control
// law. `vibench.acquisition.instruments` limits the sizes.
STRUCTURE(Controller,
  double theta;                // phase of the sample [rad], within a turn
  double omega;                // phase per sample [rad]
  double omega_from, omega_to;  // omega before and after a glide
  double glide, glide_step;    // progress of the glide from 0 to 1; increase per sample
  double fade, fade_step;      // fades the output from 1 to 0; decrease per sample
  double limit;                // largest output [V]
  double at_limit, most_at_limit;  // consecutive samples with the output at its limit, and their limit
  double unheard, most_unheard;  // samples since the host's last request, and their limit
  double block;                // length of a block of coefficients [periods]
  double turns;                // periods since the block began
  double weight;               // sum of the weights in the block
  int64_t is_steady;           // whether nothing was changed during the block
  int64_t done;                // 1 after a completed block, 2 if nothing was changed during it
  int64_t is_on;
  int64_t harmonics;           // harmonics that are played, and that are measured
  int64_t remembered;          // size of the law's memory
  double step[64][64];         // matrix of the law from memory to memory
  double inlet[64][2];         // from inputs to memory [1/V]
  double output[64];           // from memory to output [V]
  double direct[2];            // from inputs to output
  double memory[64];
  Phasor reference[2][20];     // coefficients before the glide and after it, from the first harmonic on [V]
  Phasor sums[3][21];          // sums of the block for output, base and m0, from the mean on
  Phasor coefficients[3][21];  // Fourier coefficients of the last block [V]
)

// Amplifier, shaker and specimen: parameters, state, excitation, and results over the steps.
STRUCTURE(LoadedShaker,
  double base_displacement, base_velocity;  // [m] [m/s]
  double current;              // of the coil [A]
  double low_cut, high_cut;    // states of the amplifier's filters at the lower and upper band edge [V]
  double reactions_before[2];  // the specimen's force on the base one and two steps earlier [N]
  State specimen;
  Numbers tables;              // of the specimen on bases that are cubics over a step
  double tolerance;            // tolerance of the specimen's contacts
  double step;                 // [s]
  double gain;
  double low_decay, low_mean, high_decay, high_mean;  // decay of a first-order lag over a step, and its mean
  double clip;                 // [V]
  double current_limit;        // [A]
  double transition[3][5];     // displacement, velocity, current, voltage, force -> first three a step later
  double stroke;               // travel of the table up to its rubber stops [m]
  double stop_stiffness, stop_damping;  // [N/m] [N s/m]
  Numbers drive, noise;        // [steps]: at the amplifier's input and output [V]
  Numbers amplifier_voltage, base_acceleration, m0_velocity;  // [steps]: results [V] [m/s^2] [m/s]
  Numbers ends;                // [first steps][9]: U, dU/dt, current, x, y, z, vx, vy, vz at the end of each
  Numbers begun;               // [blocks]: number of contacts up to the end of each block of steps; or empty
  int64_t block;               // steps per block
  int64_t impacts, bumps, limited_steps;  // contacts; steps in the rubber stops; steps with clipping
)

// Connections of the analogue world and a controller: it samples means, and its output is delayed.
STRUCTURE(LoopCables,
  Controller *controller;
  LoadedShaker *shaker;        // the shaker in this loop; it uses the same `drive`
  Sensor base, m0;
  Numbers drive;               // [steps]: volts of other sources at the amplifier; the controller's are added
  Numbers late;                // [steps of latency + one sample]: delayed volts, from the next step on
  int64_t first;               // number of the first step, counted from the start of the world
  int64_t begin, stop;         // range of steps to be played next
  int64_t steps_per_sample;
  double base_sum, m0_sum;     // sums of volts since the last sample
  double steps_heard;          // number of steps in the two sums
)

// ---- Hidden-state estimation (docs/hidden-motion.md). States are X, Y, Z and their rates relative to the
// base, the base's velocity W, the error B of the recorded acceleration, and the deviations of estimated
// parameters.

// A stop with indentation d has the force (K d^n + k d)(1 + loss dd/dt).
STRUCTURE(TrackedStop,
  double lower_gap, upper_gap;  // at negative and positive p [m]
  double steepness;            // K [N/m^n]
  double exponent;             // n
  double spring;               // k [N/m]
  double loss;                 // [s/m]
  double inverse_m1, inverse_m2;  // [1/kg]
)

// Data of a filter for every sample, before the update with this sample.
STRUCTURE(TrackRecord,
  Numbers states;              // [samples][8]
  Numbers covariances;         // [samples][8][8]
  Numbers innovations;         // [samples][2]: the innovation [m/s] and its variance, 0 where it was not used
  Numbers kinds;               // [samples]: `StepKind`
  Numbers jacobians;           // [samples][8][8]: filled for steps with contact
  Numbers impulses;            // [samples]: on m1 [N s]
)

// A Kalman filter over the samples of two channels.
STRUCTURE(MotionFilter,
  Numbers acceleration;        // of the base [samples + 1] [m/s^2]
  Numbers velocity;            // of m0 [samples] [m/s]; NaN where it was not measured
  Numbers flows, small_flows;  // [1 + parameters][8][10]: state, acceleration and its increase -> state a step later
  Numbers stops;               // [1 + parameters] of `TrackedStop`
  Numbers deviations;          // [parameters]: parameter steps of the second and later flows and stops
  double step;                 // [s]
  int64_t small_steps;         // substeps of a step with contact
  Numbers noise;               // Q of a step [states][states]
  double velocity_variance;    // [m^2/s^2]
  double impulse_share;        // relative error of a collision's impulse
  Numbers force_variance;      // of an unknown contact force held over each sample [samples] [N^2]
  Numbers force_input;         // [8]: change of the state by a force pair of 1 N on m1 and m2 over a step
  double level;                // running mean of the squared normalised innovation
  double level_share;          // weight of one sample in `level`
  double limit;                // above this `level` the motion is lost
  Numbers state;               // [states]
  Numbers covariance;          // [states][states]
  TrackRecord record;          // empty if there are parameters
)

// A backward smoother of the filter's data.
STRUCTURE(MotionSmoother,
  TrackRecord record;
  Numbers flow;                // [8][10], of the filter
  Numbers force_variance;      // [samples] [N^2]; or empty
  Numbers force_input;         // [8]
  Numbers states;              // [samples][8]: this and the following are results
  Numbers variances;           // [samples][2]: of p and of its rate
  Numbers forces;              // [samples][2]: the unknown force on m1 and its variance; or empty
  Numbers matrix;              // [8][8]: M of the first sample, whose smoothed covariance is P - P M P
)

// Contacts of a smoothed motion, simulated between its samples.
STRUCTURE(ContactSearch,
  Numbers states;              // [samples][8]
  Numbers touched;             // [samples]: 0 where a step was a flight
  Numbers acceleration;        // of the base; longer than `states` by the longest contact [m/s^2]
  Numbers small_flow;          // [8][10]
  Numbers stop;                // one `TrackedStop`
  double step;                 // [s]
  int64_t small_steps;
  int64_t longest;             // samples: after a longer contact, m1 counts as resting on the stop
  Numbers contacts;            // [contacts][7]: the results, in the order of `TrackedContact`
)

// ---- Chains: specimens whose m0 are coupled in series, the first to the base (decision 0011)

// Data of all equal cells: specimen, and the link from its m0 to the m0 of the next cell.
STRUCTURE(CellKind,
  Specimen specimen;
  PowerTerms power;            // for the law POWERS
  double next_stiffness;       // stiffness of this link [N/m]; 0 at the free end
  double next_damping;         // damping of this link [N s/m]
)

STRUCTURE(CellState,
  double p, x, z, vp, vx, vz;  // p = y - z [m, m/s]
  double side, root, rate, step, root_scale, rate_scale, pace;  // of the present contact, as in `State`
  double power_step;           // under a power law: length of the next step [s]; 0 before the first
  double size;                 // under a power law: recent size of p [m]
)

STRUCTURE(ChainMotion,
  Numbers kinds;               // [kinds] of `CellKind`
  Numbers kind_of;             // [cells]: number of the kind of each cell
  Numbers states;              // [cells] of `CellState`
  double clock_high, clock_low;  // time is their exact sum [s]
  double until;                // time to advance to [s]
  double tolerance;
  double fastest;              // largest rate of chain and drive [1/s]
  Numbers windows;             // [levels]: lengths of windows, long to short [s]
  Numbers clashes;             // [levels]: cells this close to each other are not both integrated in a window
  Drive drive;
  Numbers pieces;              // [pieces][8]: force of the base on the first m0 [N], instead of the
                               // drive, by powers of the time since each piece began; or empty
  double piece_start, piece_length;  // [s]
  const CollisionShapes *collisions;
  const PowerShapes *power_shapes;
  int64_t windows_left;        // number of windows that may still be made
  double start;                // time of sample 0 [s]
  double sample_rate;          // [Hz]
  Numbers samples;             // [samples][cells][6]: x, y, z, vx, vy, vz
  int64_t samples_kept;
  Numbers impact_times;        // [impacts]: ascending except within a window; a run ends when this is full
  Numbers impact_cells;        // [impacts]: number of the cell
  int64_t impacts;
  int64_t watch;               // one of `Watch`
  Numbers peaks;               // [cells][2]: largest |x| and |p| [m]
  Numbers lines;               // [cells][2]: integral of each force times exp(-i (omega t + phase)) [N s]
  Numbers memory;              // [vibench_chain_memory(cells, kinds)]
)

}  // namespace vibench
