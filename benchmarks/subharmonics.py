"""Print stability and phase of subharmonic motions of the paper's specimen and similar specimens.

    python benchmarks/subharmonics.py [--laws stops p3] [--levels 1e-6 2e-6] [--starts 12] [--seed 1]

For each contact law, level of the base and period of two and three drive periods, motions of that period are
searched for. Random initial states cover a band around two or three times the first mode, and each branch is
followed along frequency. For the stable parts, the script prints frequencies, amplitude of m0 at the
subharmonic, and the phase for a phase-locked loop. This phase is the phase of the subharmonic times the
number of drive periods, minus the phase of the base. A quarter of a period behind for three drives (three
eighths for two) is what Volvert and Kerschen (J. Sound Vib. 511, 2021) call phase resonance. A loop needs a
stable point there, and a phase that falls as the frequency rises.
"""

import argparse
from collections.abc import Iterator

import numpy as np

from vibench.sim import Accuracy, Branch, FrequencyPath, Harmonic, Specimen, integrate, load_specimen
from vibench.sim.branches import MotionSearch, shoot_branches

AIM_DEG = {2: -135.0, 3: -90.0}
BANDS_HZ = {2: (180.0, 260.0), 3: (270.0, 420.0)}
LEVELS_M = (1e-6, 2e-6, 4e-6)
LAWS = {
    "stops": ("gong2025", "hertz"),
    "uneven-stops": ("asymmetric", "hertz"),
    "p3": ("gong2025", "power:3"),
    "p5": ("gong2025", "power:5"),
    "bumpers": ("asymmetric", "linear_gap:100"),
}
"""Specimen and contact law by name."""
SAMPLES = 128
LEAST_M = 1e-8
"""Smallest amplitude that counts as a subharmonic [m]; below, the motion has a shorter period."""


def subharmonic(specimen: Specimen, drive: Harmonic, state: np.ndarray, periods: int) -> tuple[float, float]:
    """Return amplitude [m] and phase [degrees] of m0 at the drive frequency divided by ``periods``."""
    rate_hz = SAMPLES * drive.frequency_hz
    run = integrate(
        specimen, drive, periods / drive.frequency_hz, Accuracy.STANDARD, state, sample_rate_hz=rate_hz
    )
    moved = run.states[: SAMPLES * periods, 0]
    turns = np.exp(-2j * np.pi * np.arange(moved.size) / moved.size)
    phasor = 2j * np.mean(moved * turns)
    return abs(phasor), float(np.degrees(periods * np.angle(phasor)) + 180) % 360 - 180


def stable_stretches(branch: Branch) -> Iterator[slice]:
    """Yield the parts of a branch with stable motions."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], branch.is_stable.astype(int), [0]])))
    yield from (slice(first, end) for first, end in zip(edges[::2], edges[1::2], strict=True))


def describe(specimen: Specimen, level_m: float, periods: int, search: MotionSearch) -> Iterator[str]:
    """Yield one line for each stable part of the branches at a level."""
    path = FrequencyPath((level_m,))
    for found in shoot_branches(specimen, path, *BANDS_HZ[periods], search):
        if found.periods != periods:
            continue
        branch = found.branch
        for part in stable_stretches(branch):
            hertz = branch.frequencies_hz[part]
            seen = np.array(
                [
                    subharmonic(specimen, Harmonic(float(f), level_m), state, periods)
                    for f, state in zip(hertz, branch.states[part], strict=True)
                ]
            )
            if len(hertz) < 2 or seen[:, 0].max() < LEAST_M:
                continue
            upwards = np.argsort(hertz)
            off_deg = np.unwrap(seen[upwards, 1] - AIM_DEG[periods], period=360)
            off_deg -= 360 * np.round(off_deg[len(off_deg) // 2] / 360)
            meets = "meets it" if off_deg.min() <= 0 <= off_deg.max() else "never there"
            slope = float(off_deg[-1] - off_deg[0])
            yield (
                f"{hertz.min():.2f} to {hertz.max():.2f} Hz, {1e6 * seen[:, 0].min():.2f} to "
                f"{1e6 * seen[:, 0].max():.2f} um, {off_deg.min():+.0f} to {off_deg.max():+.0f} degrees from "
                f"phase resonance ({meets}, {'falls' if slope < 0 else 'rises'} by {abs(slope):.0f})"
            )


def main() -> None:
    """Print every stable part of all branches of subharmonic motions."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--starts", type=int, default=12, help="random starts at each of 9 frequencies")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--laws", nargs="+", choices=LAWS, default=list(LAWS))
    parser.add_argument("--levels", nargs="+", type=float, default=LEVELS_M, help="of the base [m]")
    options = parser.parse_args()
    search = MotionSearch(places=9, starts=options.starts, most_periods=3, seed=options.seed)
    for name in options.laws:
        described, law = LAWS[name]
        specimen = load_specimen(described).specimen(law)
        for periods in AIM_DEG:
            for level_m in options.levels:
                said = list(describe(specimen, level_m, periods, search))
                print(
                    f"{name}, {1e6 * level_m:g} um, {periods} drives a period: {len(said)} stable stretches"
                )
                for each in said:
                    print(f"    {each}", flush=True)


if __name__ == "__main__":
    main()
