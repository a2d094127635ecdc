"""The dampings at which claims are measured again: the paper leaves its unit open."""

from ..paper_figures import FigureOptions
from ._case import damping

SCORED_S = (1e-5, 1.5e-5, 2e-5, 2.5e-5, 3e-5, 4e-5, 5e-5)
"""c_i / k_i: 1e-5 s is the literal reading in mm, g and ms; the chaos that the paper shows ends above."""
DAMPINGS = tuple(damping(value) for value in SCORED_S if value != FigureOptions.damping_time_s)
"""Tried, in this order, where a claim turns on the damping."""
