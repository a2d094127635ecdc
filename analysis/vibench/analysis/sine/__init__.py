"""Measurements under a sine: sweeps, dwells, stepped sines, tracked resonances.

Results are Responses I and II of the paper, their phase and orders, collision regions, jumps and hysteresis.
Dwells also have the motion once per drive period with its verdict, and the level in the bands of the bound
modes (terminal resonances). docs/feedback.md describes the findings of feedback.
"""
