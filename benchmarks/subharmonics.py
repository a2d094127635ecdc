"""Subharmonic motions of the paper's specimen and its kin: where they are stable, and how their phase goes.

    python benchmarks/subharmonics.py [--laws stops p3] [--levels 1e-6 2e-6] [--starts 12] [--seed 1]

For each contact law, level of the base and period of two and three drives: motions of that period are looked
for from random starts over a band around so many times the first mode, and each branch is followed along
frequency. Printed is, over its stable points: frequencies, amplitude of m0 at the subharmonic, and the phase
for which a phase-locked loop would have to aim: as many times the subharmonic's as the motion has drives,
less the base's. A quarter of a period behind for three drives (three eighths for two) is what Volvert and
Kerschen (J. Sound Vib. 511, 2021) call phase resonance. A loop needs a stable point there, and a phase that
falls as the frequency rises.
"""

import argparse
from collections.abc import Iterator

import numpy as np

from vibench.sim import Accuracy, Branch, FrequencyPath, Harmonic, Specimen, integrate, load_specimen
from vibench.sim.branches import MotionSearch, shot_branches

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
"""Specimen and contact law of each."""
SAMPLES = 128
LEAST_M = 1e-8
"""A smaller subharmonic is none: the motion repeats sooner."""


def subharmonic(specimen: Specimen, drive: Harmonic, state: np.ndarray, periods: int) -> tuple[float, float]:
    """Give amplitude [m] and phase [degrees] of m0 at the drive's frequency over ``periods``."""
    rate_hz = SAMPLES * drive.frequency_hz
    run = integrate(
        specimen, drive, periods / drive.frequency_hz, Accuracy.STANDARD, state, sample_rate_hz=rate_hz
    )
    moved = run.states[: SAMPLES * periods, 0]
    turns = np.exp(-2j * np.pi * np.arange(moved.size) / moved.size)
    phasor = 2j * np.mean(moved * turns)
    return abs(phasor), float(np.degrees(periods * np.angle(phasor)) + 180) % 360 - 180


def stable_stretches(branch: Branch) -> Iterator[slice]:
    """Give the stretches of a branch on which its motions are stable."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], branch.is_stable.astype(int), [0]])))
    yield from (slice(first, end) for first, end in zip(edges[::2], edges[1::2], strict=True))


def describe(specimen: Specimen, level_m: float, periods: int, search: MotionSearch) -> Iterator[str]:
    """Say what is found at a level, a stretch of stable motions a row."""
    path = FrequencyPath((level_m,))
    for found in shot_branches(specimen, path, *BANDS_HZ[periods], search):
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
    """Print every stretch of stable subharmonic motions."""
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
