"""Measurements under a sine: sweeps, dwells, stepped sines, tracked resonances.

Responses I and II (the paper's), their phase and orders, where the masses collide, where a response
jumps and hysteresis between up and down, the motion once per drive period and the verdict on it,
what moved to the bands of the bound modes (terminal resonances), and what feedback found (docs/feedback.md).
"""
