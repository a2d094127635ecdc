"""Measure the share of the true impacts that the live view counts.

    python benchmarks/impact_counter.py

The specimen is simulated with sine drives, so that every impact is known. The velocity of m0 gets the noise
of the virtual rig's vibrometer, and is passed to the counter in blocks of 50 ms, as in a run.
"""

import numpy as np

from vibench.analysis.live._view import ImpactCounter
from vibench.sim import Harmonic, gong2025, integrate

RATE_HZ = 51_200.0
BLOCK = 2560
DURATION_S = 4.0
NOISE_M_PER_S = 6e-6
"""Noise of a sample, as recorded on the virtual rig."""
SINES = (
    (95.0, 3e-6),
    (190.0, 5e-6),
    (240.0, 2e-6),
    (260.0, 5e-6),
    (266.0, 10e-6),
    (290.0, 5e-6),
    (300.0, 50e-6),
    (320.0, 20e-6),
    (436.0, 20e-6),
)
VELOCITY = 3
"""Column of the velocity of m0 in a state x, y, z, vx, vy, vz."""


def main() -> None:
    """Simulate each sine, count its impacts, and print both numbers."""
    rng = np.random.default_rng(0)
    print("    drive            impacts a second    counted")
    for frequency_hz, amplitude_m in SINES:
        motion = integrate(
            gong2025(), Harmonic(frequency_hz, amplitude_m), DURATION_S, sample_rate_hz=RATE_HZ
        )
        velocity = motion.states[:, VELOCITY]
        seen = velocity + NOISE_M_PER_S * rng.standard_normal(velocity.size)
        counter = ImpactCounter(RATE_HZ)
        for first in range(0, seen.size, BLOCK):
            counter.add(seen[first : first + BLOCK])
        happened = motion.impacts.count
        share = f"{100 * counter.count / happened:.0f} %" if happened else f"{counter.count}"
        drive = f"{frequency_hz:g} Hz, {1e6 * amplitude_m:g} um"
        print(f"    {drive:<17}{happened / DURATION_S:<20.0f}{share}")


if __name__ == "__main__":
    main()
