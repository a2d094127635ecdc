"""Measurements with a sine drive: sweeps, dwells, stepped sines, tracked resonances.

Results are Responses I and II of the paper, their phase and orders, collision regions, jumps and hysteresis.
For a dwell, they include Poincaré points (one per drive period), a verdict on the motion, and levels in the
bands of the bound modes (terminal resonances). docs/feedback.md describes the findings of feedback.
"""
