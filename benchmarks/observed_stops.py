"""Compare the model of a control loop whose observer includes the stops with the usual loop without them.

    python benchmarks/observed_stops.py [--latency 3e-4] [--shifted 2e-7]

For the paper's motions with impacts behind their fold (base 1 um), and the rig with a controller, the script
prints the largest multiplier over a period of table, specimen and control law together. *Linear* is the usual
law, whose Kalman filter predicts without stops. *Constant* predicts with the slope of the stop force along
the motion, with the same gain. *Riccati* also updates the gain along the period, as an extended Kalman filter
does. With ``--shifted`` [m], both assume a p that is larger by this value. Deviations are linearised, so the
result is valid for small deviations.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.linalg import solve_discrete_are

from vibench.acquisition.rig import amplifier_of, load_rig, shaker_of, specimen_of
from vibench.sim import Harmonic
from vibench.sim.periodic.restoring_force import spring_of
from vibench.sim.periodic.shooting import PeriodMap
from vibench_fast_loop.fast_loop import branch_multipliers, impact_branch
from vibench_fast_loop.law import NOISE, PUSH_N, VOLT, LoopTiming, SampledPlant, design_law

SUBSTEPS = 40
"""Number of parts of a sample, because contacts are shorter than a sample."""
TURNS = 12
"""Number of periods after which the covariance is periodic."""
OPEN = (1.1, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0, 5.0)
"""Multipliers without control, which select the motions at which the loops are compared."""
LEVEL_M, START_HZ, RANGE_HZ = 1e-6, 97.5, (95.0, 100.0)


def transition_matrices(plant: SampledPlant, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return for each sample the transition matrix of a deviation, and the effect of its new voltage.

    Shapes (samples, n, n) and (samples, n); ``slopes`` of the stops' force, shape (samples, parts).
    """
    into, relative = plant.spring
    parts = slopes.shape[1]
    stretches = plant.stretches(parts)
    moved, volts = [], []
    for row in slopes * plant.timing.step_s / parts:
        state, volt = np.eye(plant.size), np.zeros(plant.size)
        for (matrix, gain), slope in zip(stretches, [*row, 0.0], strict=True):
            state, volt = matrix @ state, matrix @ volt + gain
            state = state + np.outer(into, relative @ state) * slope
            volt = volt + into * (relative @ volt) * slope
        moved.append(state)
        volts.append(volt)
    return np.array(moved), np.array(volts)


def gains_along(plant: SampledPlant, moved: np.ndarray) -> np.ndarray:
    """Return the Kalman gain at each sample of a period, shape (samples, n, 2), scaled as ``moved`` is."""
    scale = plant.scales
    step, volt = plant.step[0] * scale / scale[:, None], plant.step[1] / scale
    shown, pushed = plant.sensing * scale, step @ (plant.spring[0] / scale) * plant.timing.step_s
    unknown = np.outer(pushed, pushed) * PUSH_N**2 + np.outer(volt, volt) * VOLT**2
    unknown += 1e-12 * np.eye(plant.size)
    noise = np.diag(np.square(NOISE))
    covariance = solve_discrete_are(step.T, shown.T, unknown, noise)
    gains = np.empty((len(moved), plant.size, 2))
    for k in [*range(len(moved))] * TURNS:
        gains[k] = np.linalg.solve(shown @ covariance @ shown.T + noise, shown @ covariance).T
        covariance = moved[k] @ (covariance - gains[k] @ shown @ covariance) @ moved[k].T + unknown
        covariance = 0.5 * (covariance + covariance.T)
    return gains


def multipliers(plant: SampledPlant, slopes: np.ndarray, believed: np.ndarray) -> list[float]:
    """Return the largest multiplier of a period with each of both observers that include the stops."""
    scale, law = plant.scales, design_law(plant)
    shown, step = plant.sensing * scale, plant.step[0] * scale / scale[:, None]
    true, volts = transition_matrices(plant, slopes)
    seen, seen_volts = transition_matrices(plant, believed)
    true, seen = (each * scale / scale[:, None] for each in (true, seen))
    volts, seen_volts = volts / scale, seen_volts / scale
    count = len(true)
    plain = gains_along(plant, step[None])[:1].repeat(count, axis=0)
    # Find the feedback matrix, u = -feedback @ estimate, from the output of the law after a sample.
    kept = np.eye(plant.size) - plain[0] @ shown
    feedback = -np.linalg.lstsq(kept.T, law.output.T, rcond=None)[0].T
    observers = (
        (seen, seen_volts, plain),
        (seen, seen_volts, gains_along(plant, seen)),
    )
    return [_largest(true, volts, observer, feedback, shown) for observer in observers]


def _largest(
    true: np.ndarray,
    volts: np.ndarray,
    observer: tuple[np.ndarray, ...],
    feedback: np.ndarray,
    shown: np.ndarray,
) -> float:
    size = true.shape[1]
    period = np.eye(2 * size)
    for matrix, volt, model, model_volt, gain in zip(true, volts, *observer, strict=True):
        filtered = np.hstack([gain @ shown, np.eye(size) - gain @ shown])
        given = -feedback @ filtered
        plant = np.hstack([matrix, np.zeros((size, size))]) + np.outer(volt, given)
        period = np.vstack([plant, model @ filtered + np.outer(model_volt, given)]) @ period
    return float(np.abs(np.linalg.eigvals(period)).max())


def main() -> None:
    """Print a row of a table for each motion."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--latency", type=float, default=3e-4)
    parser.add_argument("--shifted", type=float, default=0.0)
    given = parser.parse_args()
    rig = load_rig(Path("virtual_rig_controller"))
    rig = rig.model_copy(update={"specimen": load_rig(Path("virtual_rig")).specimen})
    specimen = specimen_of(rig)
    spring = spring_of(specimen)
    branch = impact_branch(specimen, LEVEL_M, START_HZ, RANGE_HZ, "above")
    fold = next(each.index for each in branch.events if each.kind.value == "fold")
    sizes = np.abs(branch.multipliers[:, 0])
    for size in OPEN:
        point = fold + 1 + int(np.argmax(sizes[fold + 1 :] >= size))
        hertz = float(branch.frequencies_hz[point])
        count = round(rig.controller.rate_hz / hertz)
        timing = LoopTiming(count * hertz, given.latency)
        plant = SampledPlant(amplifier_of(rig), shaker_of(rig), specimen, timing)
        usual = branch_multipliers(plant, design_law(plant), branch, [point])
        states = PeriodMap(specimen).orbit(
            branch.states[point], Harmonic(hertz, LEVEL_M), 2 * count * SUBSTEPS
        )
        p = (states.states[:, 1] - states.states[:, 2])[1 : 2 * count * SUBSTEPS : 2].reshape(count, SUBSTEPS)
        slopes, believed = (
            spring.stiffness(each, np.zeros_like(each)) for each in (p, p + np.sign(p) * given.shifted)
        )
        found = " | ".join(f"{each:.3g}" for each in (*usual, *multipliers(plant, slopes, believed)))
        print(f"| {hertz:.3f} | {sizes[point]:.3g} | {found} |", flush=True)


if __name__ == "__main__":
    main()
