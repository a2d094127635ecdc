"""Feedback that holds unstable motions of a specimen on a shaker: the sampled plant, a law, its multipliers.

A controller samples base and m0, and sets the voltage at the amplifier some latency later. `SampledPlant`
says what a step of it makes of table, specimen and volts on their way; `designed_law` gives the linear law
(a Kalman filter and the feedback of its estimate) that damps the specimen; `loop_multiplier` says whether
a periodic motion is stable under it; `open_loop_multiplier` tells from samples of a perturbed motion
whether it would be stable without. The harmonic content of the drive is no part of the law: where the base
moves as a sine, the motion held is one of the specimen alone, whatever the law is. SI units.

>>> from vibench.sim import gong2025
>>> from vibench.sim.feedback.plant import LoopTiming, SampledPlant
>>> from vibench.sim.feedback.law import designed_law
>>> from vibench.sim.feedback.loop import loop_multiplier
>>> from vibench.sim.shaker.parts import Amplifier, Shaker
>>> table = Shaker(
...     moving_mass_kg=0.127, suspension_stiffness_n_per_m=9932.0, suspension_damping_ns_per_m=21.51,
...     force_constant_n_per_a=6.78, coil_resistance_ohm=2.6, coil_inductance_h=1e-4,
... )
>>> plant = SampledPlant(Amplifier(gain=3.16), table, gong2025(), LoopTiming(10_240.0, 3e-4))
>>> law = designed_law(plant)
>>> loop_multiplier(plant, law, [0.0] * 102) < 1.0
True
"""
