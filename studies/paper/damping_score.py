"""How many of the paper's claims hold at each damping, and the two exponents that decide it."""

import numpy as np

from vibench.analysis.report import (
    LEVELS,
    MEASURED,
    SIMULATED,
    TERMINAL,
    DrawnFigure,
    new_figure,
    styled,
    table,
)

from .exponent_claims import NEAR_ZERO_PER_S, SEVERE_PER_S
from .score import DampingScore

_LINEAR_PER_S = 10.0
"""The axis of exponents is linear around zero, up to here."""


def damping_score_figure(scores: tuple[DampingScore, ...]) -> DrawnFigure:
    """Draw the score, and the largest exponents at 1 and 5 um, over the damping."""
    damping = np.array([each.damping_time_s for each in scores])
    held = np.array([len(each.held) for each in scores])
    asked = len(scores[0].held) + len(scores[0].failed)
    weak = np.array([each.weak_exponent_per_s for each in scores])
    moderate = np.array([each.moderate_exponent_per_s for each in scores])
    with styled():
        figure = new_figure(4.6)
        top, bottom = figure.subplots(2, 1, sharex=True)
        top.plot(1e6 * damping, held, color=MEASURED, marker="o")
        top.set_ylim(0, asked)
        top.set_ylabel(f"claims that hold, of {asked}")
        bottom.set_yscale("symlog", linthresh=_LINEAR_PER_S)  # first: margins are those of the scale
        bottom.plot(1e6 * damping, weak, color=LEVELS[0], marker="o", label="1 µm: near zero in the paper")
        bottom.plot(
            1e6 * damping, moderate, color=SIMULATED, marker="s", label="5 µm: above 100 in the paper"
        )
        for bound in (NEAR_ZERO_PER_S, SEVERE_PER_S):
            bottom.axhline(bound, color=TERMINAL, linestyle=":", linewidth=1.0)
        bottom.set_ylabel("largest exponent [1/s]")
        bottom.set_xlabel("c / k [µs]")
        bottom.legend()
    return DrawnFigure(
        name="reproduction_damping",
        title="Claims that hold, by damping",
        caption="Dotted: what counts as near zero, and what the paper calls severe.",
        figure=figure,
        tables=(
            table(
                "reproduction_damping",
                damping_time_s=damping,
                claims_that_hold=held,
                exponent_1um_per_s=weak,
                exponent_5um_per_s=moderate,
            ),
        ),
    )
