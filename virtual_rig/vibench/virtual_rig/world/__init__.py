"""The analogue world between generator terminal and converter inputs, simulated on a time grid.

One loop of the native engine (`vibench.sim.shaker`) simulates amplifier, shaker and specimen. Sensors,
cables, input stages, anti-alias filter and seeded noise are included. All quantities are means over a time
step, in SI units. The converter's clock defines rig time. This package does not depend on SCPI or DAQmx.
"""
