"""Test how often a fit's intervals contain the truth, and how often wrong models are named.

    python benchmarks/fit_coverage.py --draws 200                    # all cases, on random rigs
    python benchmarks/fit_coverage.py --draws 250 --shard 1/4 --json # a quarter of a thousand, as numbers

Each draw has a random specimen (masses, frequencies, damping), clock and noise, and 4 to 24 realisations. The
bench description has random errors of some per cent in all linear parameters. Wrong models contain one false
assumption. The further mode is a fourth mass, solved as such. Friction between base and m0 is integrated
separately, and analysed like a recording. The effect of a wrong model is above the noise if the chi square of
its misfit without noise would be refused in 95 of 100 cases. Transmission does not depend on the table's mass
and the gaps. These are tested with recordings of random rigs whose description is wrong; the effect is above
the noise if the fit determines the quantity well enough.
"""

import argparse
import json
import math
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray
from scipy.stats import ncx2
from twin_agreement import random_rig as random_bench

from vibench.acquisition import open_bench, rig as hardware, run_measurement
from vibench.acquisition.plan import Dwell, Measurement, WhiteNoise
from vibench.analysis import (
    Estimator,
    FrequencyResponse,
    NotEnoughData,
    Simulation,
    analyse_files,
    update_model,
)
from vibench.analysis.fit.lines import Parameter
from vibench.analysis.fit.specimen_fit import Assumption, fit_specimen
from vibench.analysis.fit.updated_specimen import UpdatedSpecimen
from vibench.analysis.frequency_response.noise_response import scatters_beyond_noise
from vibench.analysis.frequency_response.periodic import PeriodicSums
from vibench.analysis.frequency_response.results import (
    FrequencyResponseSettings,
    converted_frequency_response,
)
from vibench.analysis.hidden_motion import Hidden
from vibench.analysis.signals import Quantity
from vibench.sim import Specimen, base_transmissibility, gong2025

Complexes = NDArray[np.complex128]
Reals = NDArray[np.float64]
LINES_HZ = np.arange(50.0, 600.0, 4.0)
EXTRA_HZ, EXTRA_SHARE, EXTRA_DAMPING = 1200.0, 0.03, 0.01
_SURELY = 0.95


@dataclass(frozen=True)
class Rig:
    """A specimen, its description, and the scatter of its measured transmission."""

    true: Specimen
    described: Specimen
    sd: Reals
    """Relative standard deviation of every line."""
    realisations: int


@dataclass(frozen=True)
class Count:
    """Results of all draws of one case."""

    case: str
    draws: int
    above_noise: int
    refused: int
    """Number of refused fits: among draws above the noise, or for a right model among all draws."""
    named_first: int
    """Number of refused fits that name the right culprit first."""
    intervals: int
    held: int


USUAL_NOISE, MUCH_NOISE = (-3.6, -2.6), (-1.5, -0.5)
"""Range of the logarithm of a line's relative scatter, where m0 moves as the base does."""


def random_rig(rng: np.random.Generator, noise: tuple[float, float] = USUAL_NOISE) -> Rig:
    """Return a random rig."""
    usual = gong2025(damping_time_s=float(rng.uniform(1.2e-5, 2.6e-5)))

    def near(values: tuple[float, float, float], share: float) -> tuple[float, float, float]:
        a, b, c = (float(each * (1 + share * rng.uniform(-1, 1))) for each in values)
        return a, b, c

    masses = near(usual.masses, 0.05)
    k0, k1, k2 = springs = near(usual.stiffnesses, 0.08)
    beta = usual.dampings[0] / usual.stiffnesses[0]
    true = replace(usual, masses=masses, stiffnesses=springs, dampings=(beta * k0, beta * k1, beta * k2))
    k0, k1, k2 = springs = near(springs, 0.03)
    beta *= float(rng.uniform(0.7, 1.4))
    described = replace(true, stiffnesses=springs, dampings=(beta * k0, beta * k1, beta * k2))
    size = np.abs(base_transmissibility(true, LINES_HZ)[:, 0])
    level = 10 ** rng.uniform(*noise)
    return Rig(true, described, level * np.sqrt(1 + 1 / size**2), int(rng.integers(4, 25)))


def mean_response(value: Complexes, rig: Rig, rng: np.random.Generator) -> FrequencyResponse:
    """Return the mean over the realisations, with the scatter estimated from these alone."""
    count, shape = rig.realisations, (rig.realisations, value.size)
    parts = math.sqrt(count) * rig.sd * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
    mean = parts.mean(axis=0)
    sd = np.sqrt(np.sum(np.abs(parts - mean) ** 2, axis=0) / (2 * (count - 1)) / count)
    sd /= np.abs(1 + mean)
    return _response(value * (1 + mean), sd, count, 1.0 / (1.0 + 2.0 * count * sd**2))


def _response(
    value: Complexes, sd: Reals, averages: float, coherence: Reals | None = None
) -> FrequencyResponse:
    return FrequencyResponse(
        frequency_hz=LINES_HZ,
        value=value,
        coherence=np.full(value.size, 0.999) if coherence is None else coherence,
        n_eff=float(averages),
        relative_sd_magnitude=sd,
        sd_phase_rad=sd,
        half_width=2 * sd,
        coherence_significance=1.0 - 0.05 ** (1.0 / (averages - 1.0)),
        resolution_hz=0.0,
        segments_used=round(averages),
        segments_excluded=0,
        settings=FrequencyResponseSettings(Estimator.DRIVE, 51200.0, 12800, "boxcar", 0.0, 0.95),
    )


Wrong = Callable[[Rig], tuple[Complexes, Specimen, bool]]
"""Function from a rig to measured response, description, and whether scatter exceeds noise."""


def plain(specimen: Specimen) -> Complexes:
    """Return the transmissibility of a specimen without contact."""
    return np.asarray(base_transmissibility(specimen, LINES_HZ)[:, 0])


def with_clock_error(rig: Rig, rng: np.random.Generator) -> Rig:
    """Return the rig as it appears with a clock error of up to 50 parts in a million."""
    faster = (1 + 50e-6 * rng.uniform(-1, 1)) ** 2
    k0, k1, k2 = (faster * each for each in rig.true.stiffnesses)
    c0, c1, c2 = (math.sqrt(faster) * each for each in rig.true.dampings)
    return replace(rig, true=replace(rig.true, stiffnesses=(k0, k1, k2), dampings=(c0, c1, c2)))


def right(rig: Rig) -> tuple[Complexes, Specimen, bool]:
    """Return a case in which only the fitted parameters are wrong."""
    return plain(rig.true), rig.described, False


def mass(index: int) -> Wrong:
    """Return a case whose description has one mass 3 % too light."""

    def wrong(rig: Rig) -> tuple[Complexes, Specimen, bool]:
        masses = [*rig.described.masses]
        masses[index] /= 1.03
        return plain(rig.true), replace(rig.described, masses=tuple(masses)), False

    return wrong


def damper(rig: Rig) -> tuple[Complexes, Specimen, bool]:
    """Return a case whose c0 is three times the described value."""
    c0, c1, c2 = rig.true.dampings
    return plain(replace(rig.true, dampings=(3 * c0, c1, c2))), rig.described, False


def sensitivity(rig: Rig) -> tuple[Complexes, Specimen, bool]:
    """Return a case whose measured response is 1 % too large."""
    return 1.01 * plain(rig.true), rig.described, False


def extra_mode(rig: Rig) -> tuple[Complexes, Specimen, bool]:
    """Return a case with a fourth, small mass on m0 whose mode is at 1.2 kHz."""
    (m0, m1, m2), k, c = rig.true.masses, rig.true.stiffnesses, rig.true.dampings
    small = EXTRA_SHARE * m0
    spring = small * (2 * np.pi * EXTRA_HZ) ** 2
    dash = 2 * EXTRA_DAMPING * np.sqrt(spring * small)
    mass = np.diag([m0, m1, m2, small])
    links = ((0, 2, k[2], c[2]), (1, 2, k[1], c[1]), (0, 3, spring, dash))
    stiffness, damping = np.zeros((4, 4)), np.zeros((4, 4))
    stiffness[0, 0], damping[0, 0] = k[0], c[0]
    for a, b, spring_ab, dash_ab in links:
        pair = np.zeros(4)
        pair[a], pair[b] = 1.0, -1.0
        stiffness += spring_ab * np.outer(pair, pair)
        damping += dash_ab * np.outer(pair, pair)
    s = 2j * np.pi * LINES_HZ[:, None, None]
    force = np.zeros((LINES_HZ.size, 4, 1), dtype=np.complex128)
    force[:, 0, 0] = k[0] + c[0] * s[:, 0, 0]
    return np.linalg.solve(mass * s**2 + damping * s + stiffness, force)[:, 0, 0], rig.described, False


FRICTION_SHARE = 0.3
"""Friction force between base and m0, over the rms damper force of that link without friction."""
RATE_HZ, REPETITION_HZ, SETTLE_S = 12_800.0, 4.0, 1.5
STEPS = 4
"""Number of integrator steps per sample."""


def _with_friction(base: Reals, specimen: Specimen, force: float, soft: float) -> Reals:
    """Return velocities of m0 relative to the base, with friction, by the fourth-order Runge-Kutta method.

    ``base`` holds base accelerations, shape (motions, samples); the result has the same shape.
    """
    step = 1.0 / (RATE_HZ * STEPS)
    flow = np.zeros((6, 6))
    flow[:3, 3:] = np.eye(3)
    flow[3:, :3] = -np.linalg.solve(specimen.mass_matrix, specimen.stiffness_matrix)
    flow[3:, 3:] = -np.linalg.solve(specimen.mass_matrix, specimen.damping_matrix)
    brake = force / specimen.masses[0]

    def slopes(state: Reals, pushed: Reals) -> Reals:
        found = flow @ state
        found[3:] -= pushed
        found[3] -= brake * np.tanh(state[3] / soft)
        return found

    state, shown = np.zeros((6, len(base))), np.zeros(base.shape)
    for sample in range(base.shape[1] - 1):
        shown[:, sample] = state[3]
        here, change = base[:, sample], (base[:, sample + 1] - base[:, sample]) / STEPS
        for part in range(STEPS):
            before, middle, after = (here + (part + along) * change for along in (0.0, 0.5, 1.0))
            first = slopes(state, before)
            second = slopes(state + 0.5 * step * first, middle)
            third = slopes(state + 0.5 * step * second, middle)
            fourth = slopes(state + step * third, after)
            state = state + step / 6.0 * (first + 2.0 * (second + third) + fourth)
    shown[:, -1] = state[3]
    return shown


def with_friction(rig: Rig, rng: np.random.Generator) -> tuple[FrequencyResponse, bool | None]:
    """Simulate multisines with friction between base and m0, and estimate the transmission."""
    count, whole = round(RATE_HZ * (SETTLE_S + 2 / REPETITION_HZ)), round(RATE_HZ * 2 / REPETITION_HZ)
    omega = 2 * np.pi * np.arange(round(50 / REPETITION_HZ), round(600 / REPETITION_HZ)) * REPETITION_HZ
    motions = []
    for number in range(rig.realisations + 1):
        angle = np.outer(omega, np.arange(count) / RATE_HZ) + rng.uniform(0, 2 * np.pi, (omega.size, 1))
        base, moved = np.cos(angle).sum(axis=0), (np.sin(angle) / omega[:, None]).sum(axis=0)
        motions.append((base, moved, rng.standard_normal(count if number > 0 else 0)))
    bases = np.array([base for base, _, _ in motions])
    # Simulate without friction first, to find the typical velocity.
    soft = 1e-3 * float(np.std(_with_friction(bases[:1], rig.true, 0.0, 1.0)[0, -whole:]))
    force = FRICTION_SHARE * rig.true.dampings[0] * 1e3 * soft
    sums = PeriodicSums(RATE_HZ, REPETITION_HZ)
    for relative, (base, moved, noise) in zip(
        _with_friction(bases[1:], rig.true, force, soft), motions[1:], strict=True
    ):
        seen = relative + moved
        seen = seen + float(np.median(rig.sd)) * np.std(seen) * noise
        sums.add(base[-whole:], base[-whole:], seen[-whole:])
    found = sums.frequency_response()
    response = converted_frequency_response(
        found.frequency_response,
        drive=(Quantity.ACCELERATION, Quantity.DISPLACEMENT),
        response=(Quantity.VELOCITY, Quantity.DISPLACEMENT),
    )
    return response, scatters_beyond_noise(found)


def friction(rig: Rig) -> tuple[Complexes, Specimen, bool]:
    """Return a case with friction by Gaussian linearisation (Roberts and Spanos 2003, ch. 5)."""
    c0, c1, c2 = rig.true.dampings
    more = c0 * (1 + FRICTION_SHARE * math.sqrt(2 / math.pi))
    return plain(replace(rig.true, dampings=(more, c1, c2))), rig.described, True


CASES: dict[str, tuple[Wrong, Assumption | None]] = {
    "right model": (right, None),
    "right model, much noise": (right, None),
    "m0 +3 %": (mass(0), Assumption.M0),
    "m1 +3 %": (mass(1), Assumption.M1),
    "c0 x3": (damper, Assumption.C0),
    "vibrometer +1 %": (sensitivity, Assumption.SENSITIVITY),
    "extra mode, 1.2 kHz": (extra_mode, Assumption.EXTRA_MODE),
    "friction": (friction, Assumption.FRICTION),
}


def fit_rig(true: hardware.Rig, described: hardware.Rig, plans: list[Dwell | WhiteNoise]) -> UpdatedSpecimen:
    """Measure a virtual rig with a wrong description, and fit the specimen."""
    with TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{number}.h5" for number in range(len(plans))]
        for path, plan in zip(paths, plans, strict=True):
            with open_bench(true) as bench:
                bench.rig = described
                run_measurement(bench, Measurement(name=path.stem, excitation=plan, ramp_s=0.3), path)
        return update_model(analyse_files(paths, "wrong", Simulation.LEFT_OUT))


def weak_noise(rng: np.random.Generator) -> WhiteNoise:
    """Return random noise so weak that there are no impacts."""
    return WhiteNoise(
        amplitude_vpp=float(10 ** rng.uniform(-2.0, -1.4)),
        band_start_hz=50,
        band_stop_hz=600,
        repetition_hz=2,
        realisations=int(rng.integers(4, 11)),
        periods=2,
        settle_s=1.5,
    )


def heavier_table(rng: np.random.Generator) -> tuple[UpdatedSpecimen, bool]:
    """Fit with a table described a tenth too light; return fit, and whether the effect exceeds the noise."""
    true, _words = random_bench(rng)
    table_kg = true.shaker.moving_mass_kg + true.shaker.fixture_mass_kg
    lighter = {"fixture_mass_kg": true.shaker.fixture_mass_kg - (1 - 1 / 1.1) * table_kg}
    described = true.model_copy(update={"shaker": true.shaker.model_copy(update=lighter)})
    found = fit_rig(true, described, [weak_noise(rng)])
    return found, found.table is not None and _is_told(0.1 * table_kg, found.table.sd_kg)


def uneven_gaps(rng: np.random.Generator) -> tuple[UpdatedSpecimen, bool]:
    """Fit with gaps of 35 and 55 um described as 45 um; return as for `heavier_table`."""
    bench, _words = random_bench(rng)
    true, described = (
        bench.model_copy(update={"specimen": bench.specimen.model_copy(update={"gap_m": gap_m})})
        for gap_m in ((35e-6, 55e-6), 45e-6)
    )
    at_hz, level_vpp = float(np.round(rng.uniform(250, 272), 1)), float(rng.uniform(1.2, 3.0))
    dwell = Dwell(amplitude_vpp=level_vpp, frequency_hz=at_hz, settle_s=1.0, duration_s=2.0)
    found = fit_rig(true, described, [weak_noise(rng), dwell])
    told = () if found.collisions is None else found.collisions.determined
    gaps = [each for each in told if each.what in {Hidden.LOWER_GAP, Hidden.UPPER_GAP} and each.is_determined]
    sds = [each.half_width / 1.96 for each in gaps]
    return found, len(sds) == 2 and all(_is_told(10e-6, sd) for sd in sds)


def _is_told(effect: float, sd: float) -> bool:
    """Return whether a fit with a limit of 3.3 standard deviations refuses this effect almost certainly."""
    return effect > (3.3 + 1.65) * sd


RECORDED = {
    "table +10 %": (heavier_table, Assumption.TABLE_MASS),
    "gaps 35/55 um": (uneven_gaps, Assumption.GAPS),
}


def count_recordings(case: str, draws: int, seed: int) -> Count:
    """Measure and fit ``draws`` virtual rigs of one case."""
    wrong, culprit = RECORDED[case]
    above, refused, named = 0, 0, 0
    for number in range(draws):
        found, is_above = wrong(np.random.default_rng((seed, list(RECORDED).index(case), number)))
        above += is_above
        refused += is_above and not found.fits
        named += is_above and bool(found.suspects) and found.suspects[0].assumption is culprit
    return Count(case, draws, above, refused, named, 0, 0)


def count_rigs(case: str, draws: int, seed: int) -> Count:
    """Fit ``draws`` random rigs of one case."""
    if case in RECORDED:
        return count_recordings(case, draws, seed)
    wrong, culprit = CASES[case]
    above, refused, named, intervals, held = 0, 0, 0, 0, 0
    for number in range(draws):
        rng = np.random.default_rng((seed, list(CASES).index(case), number))
        rig = random_rig(rng, MUCH_NOISE if case == "right model, much noise" else USUAL_NOISE)
        value, described, nonlinear = wrong(with_clock_error(rig, rng))
        found: FrequencyResponse = mean_response(value, rig, rng)
        is_nonlinear: bool | None = nonlinear
        if culprit is Assumption.FRICTION:
            found, is_nonlinear = with_friction(rig, rng)
        try:
            fit = fit_specimen(found, described, is_nonlinear=is_nonlinear)
        except NotEnoughData:
            continue
        if culprit is None:
            refused += not fit.fits
            for each in fit.values:
                intervals += 1
                held += each.low <= _true_value(rig.true, each.parameter) <= each.high
            continue
        if not _is_above(value, rig, described):
            continue
        above += 1
        refused += not fit.fits
        named += bool(fit.suspects) and fit.suspects[0].assumption is culprit
    return Count(case, draws, above, refused, named, intervals, held)


def _is_above(value: Complexes, rig: Rig, described: Specimen) -> bool:
    """Return whether the misfit without noise would be refused with near certainty."""
    # Fit a measurement without noise whose scatter is known exactly.
    clean = fit_specimen(_response(value, rig.sd, 1e6), described, is_nonlinear=False)
    freedom = 2 * clean.lines - 6
    return bool(ncx2.sf(clean.limit * freedom, freedom, clean.reduced_chi_square * freedom) > _SURELY)


def _true_value(specimen: Specimen, parameter: Parameter) -> float:
    (k0, k1, k2), (m0, m1, m2) = specimen.stiffnesses, specimen.masses
    return {
        Parameter.DAMPING_TIME: specimen.dampings[0] / k0,
        Parameter.F0: math.sqrt(k0 / m0) / (2 * math.pi),
        Parameter.F1: math.sqrt(k1 / m1) / (2 * math.pi),
        Parameter.F2: math.sqrt(k2 / m2) / (2 * math.pi),
    }[parameter]


def rows(counts: list[Count]) -> Iterator[str]:
    """Yield the lines of a table for the documentation."""
    yield "| model | draws | effect above the noise | refused | right culprit first | intervals that hold |"
    yield "|---|---|---|---|---|---|"
    for each in counts:
        of = each.above_noise or each.draws
        named = f"{each.named_first} of {each.refused}" if each.above_noise else ""
        held = f"{100 * each.held / each.intervals:.1f} % of {each.intervals}" if each.intervals else ""
        above = str(each.above_noise) if each.above_noise else ""
        yield f"| {each.case} | {each.draws} | {above} | {each.refused} of {of} | {named} | {held} |"


def main() -> None:
    """Run all cases and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shard", default="1/1", help="n/of: other seeds for each")
    parser.add_argument("--case", choices=(*CASES, *RECORDED), action="append")
    parser.add_argument("--json", action="store_true")
    asked = parser.parse_args()
    seed = 1000 * asked.seed + int(asked.shard.partition("/")[0])
    counts = [count_rigs(each, asked.draws, seed) for each in asked.case or (*CASES, *RECORDED)]
    if asked.json:
        json.dump([asdict(each) for each in counts], sys.stdout)
    else:
        print(*rows(counts), sep="\n")


if __name__ == "__main__":
    main()
