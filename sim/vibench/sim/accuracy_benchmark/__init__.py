"""Curve of error against computing time, for one scene and every suitable method, on this machine.

`vibench.sim.accuracy_benchmark.curve` computes the points of this curve.

>>> from vibench.sim import Harmonic, Scene, Target, gong2025
>>> from vibench.sim.accuracy_benchmark.curve import scene_curve
>>> scene = Scene(gong2025(contact="linear"), Harmonic(260.0, 1e-6), target=Target(error=0.01))
>>> next(scene_curve(scene)).method
'closed form'
"""
