// A Hertz collision as polynomials for batches, without iteration (decision 0061). The units are depth and
// time u of a collision of the same speed without other forces. In these units a collision depends only on u
// and on the acceleration of p by all other springs. The polynomials' variables are this acceleration at the
// middle, its first four derivatives, and u. Their values are the duration and the moments of the force about
// the middle. `vibench.sim.engine` fits them to solved collisions.
#pragma once
#include "structures.hpp"

namespace vibench {

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
inline void evaluate(Vector<8> (&values)[POLYNOMIALS], const Vector<8> (&variables)[VARIABLES],
                     const double (&coefficients)[COEFFICIENTS]) {
  constexpr int CHAINS = 4;  // independent sums
  Vector<8> found[MONOMIALS], sums[POLYNOMIALS][CHAINS] = {};
#if defined(__clang__)
#pragma clang loop unroll(full)
#endif
  for (int k = 0; k < MONOMIALS; k++) {
    const Monomial &monomial = THE_MONOMIALS.of[k];
    found[k] = k == 0 ? Vector<8>(1.0) : found[monomial.before] * variables[monomial.variable];
    for (int n = 0; n < POLYNOMIALS; n++)
      if (k < THE_MONOMIALS.counts[n])
        sums[n][k % CHAINS] = fused(coefficients[THE_MONOMIALS.first[n] + k], found[k], sums[n][k % CHAINS]);
  }
  for (int n = 0; n < POLYNOMIALS; n++) values[n] = (sums[n][0] + sums[n][1]) + (sums[n][2] + sums[n][3]);
}

}  // namespace vibench
