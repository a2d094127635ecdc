"""The analogue world between the generator's terminal and the converter's inputs, on a grid of time.

Amplifier, shaker and specimen in one loop of the native engine (`vibench.sim.shaker`), vibrometer and
accelerometer, cables, input stages, anti-alias filter, noise from seeds. Quantities are means over a
step, SI units; rig time counts by the converter's clock. Knows neither SCPI nor DAQmx.
"""
