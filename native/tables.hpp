// Tables for the runs of one scene, computed once from the specimen, its linear motion and the drive.
#pragma once
#include "structures.hpp"

namespace vibench {

constexpr int MODES = 6;          // largest number of modes, if all are real; usually three conjugate pairs
constexpr int PHASORS = MODES + 1;  // modes and drive
constexpr int AHEAD = 16;         // number of grid steps per evaluation, and of terms of a Taylor series
constexpr double LONGEST_TURN = 0.25;  // fastest rate times the length of a grid step [rad]

enum { REAL, IMAG };

// A sum of rotating and decaying phasors. The drive is the last term, at index `modes`.
struct LinearTables {
  int modes;
  double grid;               // grid step [s]
  Phasor rates[PHASORS];     // rates l_j [1/s]
  double squares[PHASORS];   // |l_j|^2
  Phasor shapes[PHASORS][6];
  Phasor path[PHASORS];      // contribution of a unit phasor to p
  Phasor across[PHASORS];    // contribution of a unit phasor to x
  Phasor rows[MODES][6];
  double ahead[PHASORS][2][AHEAD];   // exp(l_j grid n), n = 1 ... 16
  double series[PHASORS][2][AHEAD];  // Taylor coefficients of exp(l_j t)
};

// Indices of the state in a collision: p, x, z, their rates, and the drive's phasor. WIDE is their number.
enum { P, AT_X, AT_Z, P_RATE, X_RATE, Z_RATE, COSINE, SINE, WIDE };
constexpr int TERMS = 8;  // number of terms of a Taylor series over a collision

// Taylor series of the matrix exponential, for the motion without contact force, in units of 1 / fastest.
struct CollisionTables {
  double fastest;                   // largest rate of modes and drive [1/s]
  double powers[TERMS][WIDE][WIDE];  // [m][j][i]: effect of component j on component i, (A / fastest)^m / m!
  double struck[TERMS][WIDE];        // [m][i]: effect of a unit contact force on component i
  double onto_p[WIDE][TERMS];        // [j][m]: effect of component j on the m-th term of p
  double onto_x[WIDE][TERMS];        // [j][m]: effect of component j on the m-th term of x
  const CollisionShapes *shapes;
};

// Rows x and p of (i omega - A)^-1, for eq. 1 as s' = A s + b f with the stops' force f. They convert Fourier
// integrals of s' and f into Fourier integrals of x and p.
struct LineTables {
  Phasor across[6], path[6];
  Phasor struck_x, struck_p;  // [m s / (N s)]
};

struct PowerTables;

// Data of a specimen, independent of the drive.
struct Body {
  Specimen specimen;
  double pair;          // m1 m2 / (m1 + m2), the effective mass of a collision [kg]
  double inverse0, inverse1, inverse2, inverse_pair;  // [1/kg]
};

struct Tables : Body {
  Drive drive;
  double omega;         // drive frequency [rad/s]
  LinearTables flight;
  LinearTables held;
  LineTables lines;
  Phasor pulls[PHASORS];
  double let_go, rests;
  CollisionTables collision;
  const PowerTables *power;  // tables for a power law, stored after these tables; otherwise null
};

INLINE double gap_at(const Specimen &specimen, double side) {
  return side > 0.0 ? specimen.upper_gap : specimen.lower_gap;
}

inline void fill_linear_tables(LinearTables &t, const LinearMotion &motion, double omega) {
  t = {};
  t.modes = int(motion.modes);
  double fastest = omega;
  for (int j = 0; j <= t.modes; j++) {
    bool is_drive = j == t.modes;
    t.rates[j] = is_drive ? Phasor{0.0, omega} : motion.rates[j];
    t.squares[j] = t.rates[j].re * t.rates[j].re + t.rates[j].im * t.rates[j].im;
    fastest = larger(fastest, square_root(t.squares[j]));
    for (int i = 0; i < 6; i++) {
      t.shapes[j][i] = is_drive ? motion.steady[i] : motion.shapes[j][i];
      if (!is_drive) t.rows[j][i] = motion.rows[j][i];
    }
    t.path[j] = t.shapes[j][Y] - t.shapes[j][Z];
    t.across[j] = t.shapes[j][X];
  }
  t.grid = LONGEST_TURN / fastest;
  for (int j = 0; j <= t.modes; j++) {
    Phasor term{1.0, 0.0};
    for (int n = 0; n < AHEAD; n++) {
      Phasor ahead = grown(t.rates[j], t.grid * (n + 1));
      t.ahead[j][REAL][n] = ahead.re, t.ahead[j][IMAG][n] = ahead.im;
      t.series[j][REAL][n] = term.re, t.series[j][IMAG][n] = term.im;
      term = (1.0 / (n + 1)) * (term * t.rates[j]);
    }
  }
}

// Gong et al. 2025, eq. 1, as du/dt = A u + b F for u = (p, x, z, dp/dt, vx, vz, cos, sin); F is eq. 2.
inline void fill_equations(double (&A)[WIDE][WIDE], double (&b)[WIDE], const Specimen &s, const Drive &drive) {
  double omega = 2.0 * PI * drive.frequency, inverse_pair = 1.0 / s.m1 + 1.0 / s.m2;
  double pull[WIDE] = {}, press[WIDE] = {}, base[WIDE] = {};
  pull[AT_Z] = s.k2, pull[AT_X] = -s.k2, pull[Z_RATE] = s.c2, pull[X_RATE] = -s.c2;
  press[P] = s.k1, press[P_RATE] = s.c1;
  base[AT_X] = -s.k0, base[X_RATE] = -s.c0, base[COSINE] = drive.force.re, base[SINE] = -drive.force.im;
  for (int j = 0; j < WIDE; j++) {
    A[P][j] = A[AT_X][j] = A[AT_Z][j] = A[COSINE][j] = A[SINE][j] = b[j] = 0.0;
    A[X_RATE][j] = (pull[j] + base[j]) / s.m0;               // m0 x''
    A[P_RATE][j] = pull[j] / s.m2 - press[j] * inverse_pair;  // p'' = y'' - z''
    A[Z_RATE][j] = (press[j] - pull[j]) / s.m2;               // m2 z''
  }
  A[P][P_RATE] = A[AT_X][X_RATE] = A[AT_Z][Z_RATE] = 1.0;
  A[COSINE][SINE] = -omega, A[SINE][COSINE] = omega;
  b[P_RATE] = -inverse_pair, b[Z_RATE] = 1.0 / s.m2;
}

// Computes the Taylor series of exp(A t) and of the effect of a unit force, with t in units of 1 / fastest.
template <int N>
inline void fill_series(double (&powers)[N][WIDE][WIDE], double (&struck)[N][WIDE], double fastest,
                        const Specimen &specimen, const Drive &drive) {
  double A[WIDE][WIDE], b[WIDE], power[WIDE][WIDE] = {}, factorial = 1.0;
  fill_equations(A, b, specimen, drive);
  for (int i = 0; i < WIDE; i++) power[i][i] = 1.0;
  for (int m = 0; m < N; m++) {
    for (int i = 0; i < WIDE; i++) {
      struck[m][i] = 0.0;
      for (int j = 0; j < WIDE; j++) {
        powers[m][j][i] = power[i][j] / factorial;
        struck[m][i] += power[i][j] / factorial * b[j];
      }
    }
    double next[WIDE][WIDE] = {};
    for (int i = 0; i < WIDE; i++)
      for (int j = 0; j < WIDE; j++)
        for (int k = 0; k < WIDE; k++) next[i][j] += A[i][k] / fastest * power[k][j];
    __builtin_memcpy(power, next, sizeof power);
    factorial *= m + 1.0;
  }
}

inline void fill_collision_tables(CollisionTables &t, const Scene &scene, const LinearTables &flight) {
  t.shapes = scene.collisions;
  t.fastest = LONGEST_TURN / flight.grid;
  fill_series(t.powers, t.struck, t.fastest, scene.specimen, scene.drive);
  for (int m = 0; m < TERMS; m++)
    for (int j = 0; j < WIDE; j++) t.onto_p[j][m] = t.powers[m][j][P], t.onto_x[j][m] = t.powers[m][j][AT_X];
}

// Sums half of each mode and half of its conjugate; this is also correct for real modes.
inline void fill_line_tables(LineTables &lines, const LinearTables &t, const Specimen &s) {
  lines = {};
  Phasor drive = t.rates[t.modes], half{0.5, 0.0};
  for (int j = 0; j < t.modes; j++) {
    Phasor near = quotient(half, drive - t.rates[j]), far = quotient(half, drive - conjugate(t.rates[j]));
    for (int i = 0; i < 6; i++) {
      Phasor x = t.across[j] * t.rows[j][i], p = t.path[j] * t.rows[j][i];
      lines.across[i] = lines.across[i] + near * x + far * conjugate(x);
      lines.path[i] = lines.path[i] + near * p + far * conjugate(p);
    }
  }
  lines.struck_x = (1.0 / s.m2) * lines.across[VZ] - (1.0 / s.m1) * lines.across[VY];
  lines.struck_p = (1.0 / s.m2) * lines.path[VZ] - (1.0 / s.m1) * lines.path[VY];
}

inline void fill_body(Body &t, const Specimen &s) {
  t.specimen = s;
  t.pair = s.m1 * s.m2 / (s.m1 + s.m2);
  t.inverse0 = 1.0 / s.m0, t.inverse1 = 1.0 / s.m1, t.inverse2 = 1.0 / s.m2, t.inverse_pair = 1.0 / t.pair;
}

inline void fill_tables(Tables &t, const Scene &scene) {
  const Specimen &s = scene.specimen;
  fill_body(t, s);
  t.power = nullptr;
  t.drive = scene.drive;
  t.omega = 2.0 * PI * scene.drive.frequency;
  fill_linear_tables(t.flight, scene.flight, t.omega);
  fill_line_tables(t.lines, t.flight, s);
  if (s.law == SPRINGS || s.law == RIGID) fill_linear_tables(t.held, scene.held.motion, t.omega);
  else t.held = {};
  __builtin_memcpy(t.pulls, scene.held.pulls, sizeof t.pulls);
  t.let_go = scene.held.let_go, t.rests = scene.held.rests;
  if (s.law == HERTZ) fill_collision_tables(t.collision, scene, t.flight);
}

}  // namespace vibench
