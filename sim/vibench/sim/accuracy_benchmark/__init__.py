"""What a level of accuracy costs and what it buys, measured on this machine, regime by regime.

`measure_accuracy` runs free, periodic and chaotic motions (`MOTIONS`) at every level of accuracy and with
general solvers of scipy, interleaved so that a busy machine slows all alike; it takes minutes. Cost is
processor time over simulated time; errors are measured against a solution that shares nothing with the
engine: DOP853 on the paper's equations as a textbook writes them. The result for one machine is
docs/accuracy.md.

>>> from vibench.sim.accuracy_benchmark.figures import MOTIONS
>>> for motion in MOTIONS[:3]:
...     print(motion.regime, "-", motion.name)
no contact - hertz, 260 Hz, 1 µm
periodic - hertz, 130 Hz, 20 µm
periodic - linear_gap, 130 Hz, 20 µm
"""
