"""The physics of the specimen: models, exact integration, responses, exponents, periodic motions.

The specimen is a chain of three masses on a moving base, with m1 between two stops on m2 (Gong et al. 2025).
x, y, z are absolute displacements [m]; m1 touches a stop when abs(y - z) reaches the gap. Motion without
contact is solved exactly, contacts numerically (docs/decisions/0004-contact-integration.md). SI units. This
package imports no other package of vibench. Use `vibench.sim.study` for many scenes and `vibench.sim.chain`
for coupled specimens. docs/accuracy.md states the computing time of each level of `Accuracy`.

>>> from vibench.sim import Harmonic, base_transmissibility, gong2025, steady_response
>>> specimen = gong2025(damping_time_s=2e-5, gap_m=45e-6, contact="hertz")
>>> free = base_transmissibility(specimen, 266.2)[0]  # x, y, z and p relative to the base, without stops
>>> [round(float(value), 1) for value in abs(free)]
[22.6, 6.0, 36.7, 42.7]
>>> drive = Harmonic(frequency_hz=130.0, amplitude_m=20e-6)
>>> response = steady_response(specimen, drive, accuracy="standard", duration_s=4.0, window_s=1.0)
>>> round(response.relative_i, 2), round(response.relative_ii, 2), response.impacts
(2.31, 1.21, 260)

`integrate` computes a motion from any state; `lyapunov_exponent` shows whether a motion is chaotic. Periodic
motions are found by shooting or harmonic balance and followed along frequency or amplitude:

>>> from vibench.sim import Precision, integrate, lyapunov_exponent, periodic_branch, periodic_orbit
>>> run = integrate(specimen, drive, duration_s=0.1, initial_state=response.final_state, sample_rate_hz=1e4)
>>> run.states.shape, run.impacts.count
((1001, 6), 26)
>>> chaos = lyapunov_exponent(specimen, Harmonic(260.0, 5e-6), precision=Precision(absolute_per_s=10.0))
>>> chaos.exponent_per_s > 5.0 * chaos.standard_error_per_s
True
>>> orbit = periodic_orbit(gong2025(damping_time_s=3e-5), drive)  # periodic, because of more damping
>>> branch = periodic_branch(orbit, "frequency", stop=131.0)
>>> orbit.impacts, orbit.is_stable, float(branch.frequencies_hz[-1]), branch.events
(2, True, 131.0, ())
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
