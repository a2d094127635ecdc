"""The analogue world between the generator's terminal and the converter's inputs, on a grid of time.

Amplifier, shaker and specimen in one loop of the native engine (`vibench.sim.shaker`), vibrometer and
accelerometer, cables, input stages, anti-alias filter, seeded noise. Quantities are means over a step, SI
units; the converter's clock defines rig time. SCPI and DAQmx are unknown here.
"""
