"""Carrying out a measurement: ramps, phases, limits, and the way out."""
