"""Sweep a chain of six cells through its band gap, without and with impacts."""

import numpy as np

from vibench.sim import LinearSweep, gong2025
from vibench.sim.chain import band_gaps, chain_energies, chain_of, integrate_chain

cell = gong2025()
chain = chain_of(cell, cells=6)
_, gap, _ = band_gaps(chain_of(cell, cells=1))
print(f"gap of the endless chain: {gap.lower_hz:.1f} to {gap.upper_hz:.1f} Hz")

for amplitude_m in (1e-6, 40e-6):
    sweep = LinearSweep(200.0, 600.0, 4.0, amplitude_m)
    run = integrate_chain(chain, sweep, sweep.duration_s, sample_rate_hz=10e3)
    # Demodulate at the instantaneous frequency: free vibration from earlier frequencies averages out.
    turning = run.states[:, -1, 0] * np.exp(-2j * np.pi * sweep.turns(run.time_s))
    within, above = (
        2.0 * abs(turning[abs(sweep.frequency_hz(run.time_s) - middle_hz) < 10.0].mean()) / amplitude_m
        for middle_hz in (410.0, 540.0)
    )
    energy = chain_energies(chain, run.states, amplitude_m * np.sin(2.0 * np.pi * sweep.turns(run.time_s)))
    share = 100.0 * energy[:, 0].mean() / energy.sum(axis=1).mean()
    print(
        f"{1e6 * amplitude_m:.0f} µm: last cell over base {within:.1e} at 410 Hz, {above:.1e} at 540 Hz; "
        f"{run.impacts.count} impacts; {share:.0f} % of the energy in the first cell"
    )
