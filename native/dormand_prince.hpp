// Dormand and Prince's method of order 8(5,3). Coefficients and error estimates are from Hairer, Norsett and
// Wanner, Solving Ordinary Differential Equations I (2nd ed. 1993), section II.10 and the code DOP853.
#pragma once
#include "scalar.hpp"

namespace vibench {

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

}  // namespace vibench
