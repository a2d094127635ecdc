"""Measurements under a sine: sweeps, dwells, stepped sines, tracked resonances.

Responses I and II (the paper's), their phase and orders, collision regions, jumps and hysteresis, the
motion once per drive period and its verdict, the level in the bands of the bound modes (terminal
resonances), and the findings of feedback (docs/feedback.md).
"""
