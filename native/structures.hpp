// Structures of the C interface. STRUCTURE declares a C++ structure and stores its source text, from which
// `vibench.sim.engine` builds the Python structure. A member may be a double, an int64_t, a Phasor, a
// structure declared above, an array, or a pointer.
#pragma once
#include "scalar.hpp"

#define STRUCTURE(Name, ...)          \
  struct Name {                       \
    __VA_ARGS__                       \
  };                                  \
  inline constexpr char Name##_text[] = #Name " { " #__VA_ARGS__ " }";

namespace vibench {

struct Tables;  // defined in tables.hpp

constexpr int MOST_POWERS = 6;  // largest number of terms of a power law

// Indices of a motion: absolute displacements [m] and velocities [m/s] of m0, m1, m2.
enum { X, Y, Z, VX, VY, VZ };

// Contact law of the stops, for `Specimen::law`.
enum Law : int64_t {
  NO_STOPS,
  HERTZ,     // eq. 2, without loss
  YIELDING,  // (linear_stiffness d + contact_stiffness d^(3/2)) (1 + loss dd/dt) at the penetration d
  SPRINGS,   // linear_stiffness d; motion solved exactly by the modes of the specimen in contact
  RIGID,
  POWERS,    // sum of odd powers of p; this force acts at every p, see `PowerTerms`
  LAWS,
};

// Reason for the end of a run, with the values of `vibench.sim.specimen.Outcome`. REFUSED: invalid arguments.
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
  double linear_stiffness;     // stiffness of linear stops [N/m]
  double contact_stiffness;    // k_contact of eq. 2 [N/m^1.5]
  double loss;                 // loss factor of Hunt and Crossley [s/m]
  double restitution;          // coefficient of restitution of rigid stops, 0 to 1
)

// A linear motion: s(t) = Re sum_j a_j shapes_j exp(rates_j t), with a_j = rows_j . s(0). Each conjugate pair
// and each real rate is one mode. `steady` is the steady motion per unit phasor of the drive.
STRUCTURE(LinearMotion,
  int64_t modes;               // number of modes, 2 to 6
  Phasor rates[6];             // [1/s]
  Phasor shapes[6][6];
  Phasor rows[6][6];
  Phasor steady[6];
)

// Motion of m1 on a rigid or linear stop: a linear motion about another rest position.
STRUCTURE(HeldMotion,
  LinearMotion motion;
  Phasor pulls[7];             // quantity that keeps m1 on the stop, per unit phasor of modes and drive
  double let_go;               // constant part of this quantity, divided by the gap
  double rests;                // constant part of |p|, divided by the gap
)

// Base motion U(t) = A0 sin(2 pi f t + phase). The drive's phasor is exp(i (2 pi f t + phase)).
STRUCTURE(Drive,
  double frequency;            // [Hz]
  Phasor start;                // drive's phasor at time zero
  Phasor force;                // k0 U + c0 dU/dt = Re(force phasor) [N]
)

// Tables of Hertz collisions (decision 0008) for every specimen, computed by `vibench.sim.engine`.
STRUCTURE(CollisionShapes,
  double shares[8][16][16];    // [m][k][i]: integral to point i of (t_i - t)^m times point k's Lagrange polynomial
  double ends[16][8];          // [k][m]: the same integral up to the end
  double weights[16];          // quadrature weights of the points for an integral over the duration
  double heights[16];          // times of the points, divided by the duration
  double about_middle[16][8];  // contribution of a depth at a point to the Taylor terms about the middle
  double shapes[41][23][16];   // table for each press, with the rows of `ShapeRow`
  double durations[41][7];     // table for each press, with the columns of `DurationColumn`
)

// F = sum forces_i (p / reference)^exponents_i at every p: the continuous model of the stops (eq. 3).
STRUCTURE(PowerTerms,
  double reference;            // reference displacement [m]
  int64_t terms;               // number of terms, 1 to 6
  int64_t exponents[6];        // odd exponents in ascending order, at least 3
  double forces[6];            // force of each term at p = reference [N]
)

// Coefficients of Gauss points on a step from 0 to 1 for every power law, computed by `vibench.sim.engine`.
STRUCTURE(PowerShapes,
  double points[8], weights[8];
  double shares[32][8][8];     // [m][k][i]: integral to point i of (c_i - s)^m times point k's Lagrange polynomial
  double ends[32][8];          // [m][k]: the same integral up to the end
  double at_start[8], at_end[8];  // value of the polynomial at start and end, per value at each point
  double course[9][8];         // [k][m]: coefficient of (s - 1)^m per value at point k, or (last) at the end
  double point_weights[8];     // barycentric weights of the points alone
  double instants[10], instant_weights[10], instant_slopes[10];  // start, points, end; barycentric data
)

// A specimen on a base whose displacement is a cubic polynomial on each of equal intervals.
STRUCTURE(CubicScene,
  Specimen specimen;
  double interval;             // length of an interval [s]
  double fastest;              // largest rate of the specimen without stops [1/s]
  PowerTerms power;            // only for the law POWERS
  const PowerShapes *power_shapes;
)

// Observed quantities of a run, for `Record::watch`.
enum Watch : int64_t {
  WATCH_NOTHING,
  WATCH_PEAKS,
  WATCH_PEAKS_AND_LINES,
  WATCHES,
};

STRUCTURE(Scene,
  Specimen specimen;
  Drive drive;
  LinearMotion flight;         // motion without contact
  HeldMotion held;             // only for SPRINGS and RIGID; zero modes for other laws
  PowerTerms power;            // only for the law POWERS
  const CollisionShapes *collisions;
  const PowerShapes *power_shapes;
)

// State of a motion, without contact (in flight) or in contact.
STRUCTURE(State,
  double motion[6];            // x, y, z, vx, vy, vz [m, m/s]
  double clock_high, clock_low;  // parts of the time, which is their exact sum [s]
  double side;                 // +1 or -1 while m1 is on the stop at positive or negative p; 0 in flight
  double root;                 // w, the square root of the penetration [m^0.5]
  double rate;                 // r = d|p|/dt [m/s]
  double step;                 // length of the next step in the variable s, where dt = w ds [s/m^0.5]
  double root_scale;           // expected largest w [m^0.5]
  double rate_scale;           // expected largest r [m/s]
  double pace;                 // expected largest w divided by expected largest r [s/m^0.5]
  double level;                // power law only: level of the next step plus one; 0 before the first step
  double sizes[3];             // power law only: recent magnitudes of p, x, z [m]
)

// Results of a run. They do not influence its steps.
STRUCTURE(Record,
  double start;                // time of sample 0 [s]
  double sample_rate;          // [Hz]
  double *samples;             // [sample_room][6]: x, y, z, vx, vy, vz
  int64_t sample_room, samples_kept;
  double *impact_times;        // [impact_room] [s]; a run ends when the array is full
  int64_t impact_room, impacts;
  int64_t steps_left;          // number of steps that the run may still take
  int64_t watch;               // one of `Watch`
  double peak_x, peak_p;       // largest |x| and |p| [m]
  Phasor line_x, line_p;       // integrals of x and p times exp(-i (omega t + phase)) [m s]
)

// An array passed for one call. Its size is checked against the sizes of related arrays before any access.
STRUCTURE(Numbers,
  double *at;
  int64_t size;
)

// Consecutive intervals, each with U = c0 + c1 tau + c2 tau^2 + c3 tau^3, and the motion at their ends.
STRUCTURE(CubicDrive,
  Numbers base;                // [intervals][4]: c0 ... c3 [m, m/s, m/s^2, m/s^3]
  double first_from, last_to;  // start of the run in the first interval, and its end in the last interval [s]
  int64_t done;                // number of finished intervals
  Numbers motions;             // [intervals][6]: x, y, z, vx, vy, vz at the end of each interval; or empty
  Numbers impacts;             // [intervals]: number of impacts in each interval; or empty
)

// Tangent vectors of a motion, integrated with it. They are its exact directional derivatives.
STRUCTURE(Tangent,
  int64_t changes;             // number of tangent vectors, 1 to 6
  double rows[6][6];           // x, y, z, vx, vy, vz of each tangent vector
  double growth[6];            // logarithm of the factor removed from each row
)

// Growth of the tangent vectors per interval. They are made orthonormal in a metric at regular intervals.
STRUCTURE(Readings,
  double interval;             // length of an interval [s]; reading k is taken at time (k + 1) interval
  int64_t parts;               // parts of an interval; vectors are made orthonormal after each part
  double metric[6][6];
  double *growth;              // [room][changes]: logarithm of the growth factor of each vector
  int64_t *impacts;            // [room]: number of impacts in each interval
  double *motions;             // [room][6]: x, y, z, vx, vy, vz at the end of each interval
  int64_t room, made;          // number of readings that fit, and number taken so far
)

// ---- Batches: motions of one specimen, eight at a time

// Monomials of the polynomials in `CollisionFit`. Python needs them for the fit.
STRUCTURE(CollisionMonomials,
  Numbers powers;              // [289][6]: powers of the variables; monomials sorted by contribution
  Numbers counts;              // [6]: number of leading monomials used by each polynomial
)

// Hertz collisions of one specimen as polynomials (decision 0061).
STRUCTURE(CollisionFit,
  double coefficients[652];    // coefficients for the duration over u, then for the moments
  double middle[6], half[6];   // centre and half range of each fitted variable
  double unit;                 // u times the fifth root of the speed [s (m/s)^(1/5)]
  double guess[4];             // approximation of speed^(-1/5): cubic in speed^(1/4), highest power first
)

// One motion of a batch.
STRUCTURE(BatchMotion,
  const Tables *tables;
  State *now;                  // state in flight at a whole drive period; advanced unless the motion fails
  double *sections;            // [periods][6]: x, y, z, vx, vy, vz once per drive period
  int64_t periods;             // number of periods to simulate
  int64_t impacts;             // number of contacts
  int64_t outcome;             // REACHED_END; after TOO_LONG or STALLED simulate the motion alone
  Record *record;              // peaks and lines, as selected by its `watch`; may be null
  Tangent *tangent;            // one tangent vector, advanced with the motion; may be null
  double *growth;              // [periods]: logarithm of its length once per drive period; null without it
  int64_t *struck;             // [periods]: number of contacts so far; null without it
)

STRUCTURE(Batch,
  BatchMotion *motions;        // [count]: for one specimen with Hertz stops and three oscillating modes
  int64_t count;
  const CollisionFit *fit;     // fit for this specimen
  double tolerance;            // relative error of a contact step outside the range of the fit
  double metric[6][6];         // metric for the length of tangent vectors
)

// ---- Signals

// Interpolation of band-limited signals between their samples.
STRUCTURE(Interpolation,
  Numbers samples;             // [channels][samples per channel]; signals are zero outside
  int64_t channels;
  Numbers table;               // [phases + 3][64]: taps, from one phase before a sample to one after the next
  Numbers positions;           // positions of the values, counted in samples from the first sample
  Numbers values;              // [channels][positions]: result
)

// Reduction of the sample rate: each sample is a weighted sum of `reach` means over equal time steps.
STRUCTURE(Decimation,
  Numbers means;
  int64_t reach;               // number of means per sample, a multiple of eight
  Numbers table;               // [rows][reach]: weights for fractions 0 to 1 of a step, or only one row
  double ratio;                // steps per sample
  double begin;                // time of the sample before sample 0 [steps]
  int64_t origin;              // index of the oldest mean of a sample, minus the sample's time in whole steps
  int64_t first;               // number of the first sample
  Numbers samples;             // result
)

// A recursive digital filter (transposed direct form II), whose state is kept from call to call.
STRUCTURE(RecursiveFilter,
  Numbers numerator;           // coefficients; the first multiplies the present value
  Numbers denominator;         // coefficients; the first is 1
  Numbers state;               // stored values; the last always stays zero
)

STRUCTURE(FilteredSignal,
  RecursiveFilter filter;
  Numbers values;
  Numbers result;
)

// ---- Analogue part of the virtual rig

// Conversion of a motion into the voltage of a sensor, over a number of steps.
STRUCTURE(Sensor,
  RecursiveFilter filter;
  Numbers noise;               // [steps]: noise in units of the motion
  Numbers instead;             // [steps]: used instead of motion plus noise, except where NaN; or empty
  double full_scale;           // full scale in units of the motion
  double full_scale_voltage;   // [V]
  Numbers motion;              // [steps]: mean of the motion over each step
  Numbers volts;               // [steps]: result
)

// A real-time controller. Its output is a Fourier series in its phase plus the output of a linear control
// law. `vibench.acquisition.instruments` limits the sizes.
STRUCTURE(Controller,
  double theta;                // phase of the sample [rad], within one period
  double omega;                // increase of the phase per sample [rad]
  double omega_from, omega_to;  // omega before and after a glide
  double glide, glide_step;    // progress of the glide from 0 to 1, and its increase per sample
  double fade, fade_step;      // factor on the output, which falls from 1 to 0, and its decrease per sample
  double limit;                // largest output [V]
  double at_limit, most_at_limit;  // number of consecutive samples at the output limit, and its limit
  double unheard, most_unheard;  // number of samples since the host's last request, and its limit
  double block;                // length of a block, from which Fourier coefficients follow [periods]
  double turns;                // periods since the start of the block
  double weight;               // sum of the weights of the samples in the block
  int64_t is_steady;           // whether frequency, reference and fade were constant in the block
  int64_t done;                // 1 after a completed block, 2 if `is_steady` as well
  int64_t is_on;
  int64_t harmonics;           // number of harmonics, both of the output and of the measurement
  int64_t remembered;          // number of states of the control law
  double step[64][64];         // state matrix of the control law
  double inlet[64][2];         // matrix that maps inputs to states [1/V]
  double output[64];           // row that maps states to the output [V]
  double direct[2];            // row that maps inputs to the output
  double memory[64];           // states of the control law
  Phasor reference[2][20];     // coefficients before and after the glide, from the first harmonic on [V]
  Phasor sums[3][21];          // sums over the block for output, base and m0, from the mean on
  Phasor coefficients[3][21];  // Fourier coefficients of the last block [V]
)

// Amplifier, shaker and specimen: parameters, state, excitation, and results over the steps.
STRUCTURE(LoadedShaker,
  double base_displacement, base_velocity;  // [m] [m/s]
  double current;              // coil current [A]
  double low_cut, high_cut;    // states of the amplifier's filters at the lower and upper band edge [V]
  double reactions_before[2];  // force of the specimen on the base one and two steps earlier [N]
  State specimen;
  Numbers tables;              // tables of the specimen on a base that is a cubic over each step
  double tolerance;            // tolerance of the specimen's contacts
  double step;                 // [s]
  double gain;
  double low_decay, low_mean, high_decay, high_mean;  // decay of a first-order lag over a step, and its mean
  double clip;                 // largest amplifier voltage [V]
  double current_limit;        // [A]
  double transition[3][5];     // displacement, velocity, current, voltage, force -> first three a step later
  double stroke;               // travel of the table to its rubber stops [m]
  double stop_stiffness, stop_damping;  // of the rubber stops [N/m] [N s/m]
  Numbers drive, noise;        // [steps]: input of the amplifier, and noise at its output [V]
  Numbers amplifier_voltage, base_acceleration, m0_velocity;  // [steps]: results [V] [m/s^2] [m/s]
  Numbers ends;                // [first steps][9]: U, dU/dt, current, x, y, z, vx, vy, vz at the end of each
  Numbers begun;               // [blocks]: number of contacts up to the end of each block of steps; or empty
  int64_t block;               // steps per block
  int64_t impacts, bumps, limited_steps;  // numbers of contacts, rubber-stop steps and clipped steps
)

// Connections of a controller to the analogue part. The controller samples means; its output is delayed.
STRUCTURE(LoopCables,
  Controller *controller;
  LoadedShaker *shaker;        // shaker in this loop, which uses the same `drive`
  Sensor base, m0;
  Numbers drive;               // [steps]: amplifier input of other sources; the controller's output is added
  Numbers late;                // [steps of latency + one sample]: delayed output [V], from the next step on
  int64_t first;               // number of the first step, counted from the start of the simulation
  int64_t begin, stop;         // first step to be simulated next, and the step after the last
  int64_t steps_per_sample;
  double base_sum, m0_sum;     // sums of the sensor voltages since the last sample
  double steps_heard;          // number of steps in the two sums
)

// ---- Hidden-state estimation (docs/hidden-motion.md). The state consists of X, Y, Z and their rates
// relative to the base, the base velocity W, the error B of the recorded acceleration, and the deviations of
// estimated parameters.

// Stop with the force (K d^n + k d)(1 + loss dd/dt) at the indentation d.
STRUCTURE(TrackedStop,
  double lower_gap, upper_gap;  // clearances at negative and positive p [m]
  double steepness;            // K [N/m^n]
  double exponent;             // n
  double spring;               // k [N/m]
  double loss;                 // [s/m]
  double inverse_m1, inverse_m2;  // [1/kg]
)

// Data of a filter at every sample, before the update with this sample.
STRUCTURE(TrackRecord,
  Numbers states;              // [samples][8]
  Numbers covariances;         // [samples][8][8]
  Numbers innovations;         // [samples][2]: innovation [m/s] and its variance; variance 0 if not used
  Numbers kinds;               // [samples]: a `StepKind` each
  Numbers jacobians;           // [samples][8][8]: Jacobians, only for steps with contact
  Numbers impulses;            // [samples]: impulse on m1 [N s]
)

// A Kalman filter over the samples of two channels.
STRUCTURE(MotionFilter,
  Numbers acceleration;        // [samples + 1]: base acceleration [m/s^2]
  Numbers velocity;            // [samples]: velocity of m0 [m/s]; NaN where it was not measured
  Numbers flows, small_flows;  // [1 + parameters][8][10]: state, acceleration and its increase -> state a step later
  Numbers stops;               // [1 + parameters] of `TrackedStop`
  Numbers deviations;          // [parameters]: parameter changes in the second and later flows and stops
  double step;                 // [s]
  int64_t small_steps;         // number of substeps of a step with contact
  Numbers noise;               // [states][states]: covariance Q of the process noise of a step
  double velocity_variance;    // variance of the measured velocity [m^2/s^2]
  double impulse_share;        // assumed relative error of a collision's impulse
  Numbers force_variance;      // [samples]: variance of an unknown force, constant over a sample [N^2]
  Numbers force_input;         // [8]: change of the state by a force pair of 1 N on m1 and m2 over a step
  double level;                // running mean of the squared normalised innovation
  double level_share;          // weight of one sample in `level`
  double limit;                // the motion counts as lost when `level` reaches this value
  Numbers state;               // [states]
  Numbers covariance;          // [states][states]
  TrackRecord record;          // empty if there are parameters
)

// A smoother that runs backwards through the filter's data.
STRUCTURE(MotionSmoother,
  TrackRecord record;
  Numbers flow;                // [8][10]: step matrix of the filter
  Numbers force_variance;      // [samples]: as in `MotionFilter` [N^2]; or empty
  Numbers force_input;         // [8]: as in `MotionFilter`
  Numbers states;              // [samples][8]: smoothed states; results start here
  Numbers variances;           // [samples][2]: variances of p and of its rate
  Numbers forces;              // [samples][2]: unknown force on m1 and its variance; or empty
  Numbers matrix;              // [8][8]: M of the first sample, whose smoothed covariance is P - P M P
)

// Search for the contacts of a smoothed motion by simulation between its samples.
STRUCTURE(ContactSearch,
  Numbers states;              // [samples][8]
  Numbers touched;             // [samples]: 0 for a step without contact
  Numbers acceleration;        // base acceleration [m/s^2]; longer than `states` by the longest contact
  Numbers small_flow;          // [8][10]: step matrix of a substep
  Numbers stop;                // one `TrackedStop`
  double step;                 // [s]
  int64_t small_steps;         // number of substeps of a step
  int64_t longest;             // longest contact [samples]; anything longer counts as rest on the stop
  Numbers contacts;            // [contacts][7]: results, in the order of `TrackedContact`
)

// ---- Chains: specimens whose m0 are coupled in series, the first to the base (decision 0011)

// Data of equal cells: the specimen, and the link from its m0 to the m0 of the next cell.
STRUCTURE(CellKind,
  Specimen specimen;
  PowerTerms power;            // only for the law POWERS
  double next_stiffness;       // stiffness of this link [N/m]; 0 at the free end
  double next_damping;         // damping of this link [N s/m]
)

STRUCTURE(CellState,
  double p, x, z, vp, vx, vz;  // displacements [m] and velocities [m/s], with p = y - z
  double side, root, rate, step, root_scale, rate_scale, pace;  // present contact, as in `State`
  double power_step;           // power law only: length of the next step [s]; 0 before the first step
  double size;                 // power law only: recent magnitude of p [m]
)

STRUCTURE(ChainMotion,
  Numbers kinds;               // [kinds] of `CellKind`
  Numbers kind_of;             // [cells]: index of each cell's kind
  Numbers states;              // [cells] of `CellState`
  double clock_high, clock_low;  // parts of the time, which is their exact sum [s]
  double until;                // time at which the run ends [s]
  double tolerance;
  double fastest;              // largest rate of chain and drive [1/s]
  Numbers windows;             // [levels]: lengths of windows, from long to short [s]
  Numbers clashes;             // [levels]: a window is too long if two cells within this distance may touch
  Drive drive;
  Numbers pieces;              // [pieces][8]: force of the base on the first m0 [N] instead of the drive, as
                               // a polynomial in the time since the start of each piece; or empty
  double piece_start, piece_length;  // start of the first piece, and length of each piece [s]
  const CollisionShapes *collisions;
  const PowerShapes *power_shapes;
  int64_t windows_left;        // number of windows that the run may still take
  double start;                // time of sample 0 [s]
  double sample_rate;          // [Hz]
  Numbers samples;             // [samples][cells][6]: x, y, z, vx, vy, vz
  int64_t samples_kept;
  Numbers impact_times;        // [impacts] [s]: ascending except within a window; a run ends when it is full
  Numbers impact_cells;        // [impacts]: index of the cell
  int64_t impacts;
  int64_t watch;               // one of `Watch`
  Numbers peaks;               // [cells][2]: largest |x| and |p| [m]
  Numbers lines;               // [cells][2]: integral of each force times exp(-i (omega t + phase)) [N s]
  Numbers memory;              // [vibench_chain_memory(cells, kinds)]
)

}  // namespace vibench
