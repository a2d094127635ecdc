"""Sweeps: responses over frequency, and where the masses collide."""

from collections.abc import Callable

from vibench.acquisition.recording import SegmentLabel

from ..comparison.recording_curves import sweep_traces
from ..frequency_response.request import FrequencyResponseRequest
from ..overlay.draws import Draw
from ..overlay.overlay import sweep_endings, sweep_overlay, sweep_quantities
from ..overlay.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels
from ..recordings.checks import measurement_checks
from ..recordings.facts import RecordingFacts, known_specimen
from ..sine.collision_region import collisions
from ..sine.sweep import SweptMotion
from ..sine.sweep_analysis import (
    Sweep,
    SweepAnalysis,
    SweepDraws,
    measured_sweep,
    played_check,
    smooth_jumps,
)
from ..uncertainty.quantities import sweep_budgets
from .analysis_kind import AnalysisKind


def _analyse(
    facts: RecordingFacts, channels: Channels, plan: Sweep, _: FrequencyResponseRequest
) -> SweepAnalysis:
    # The linear simulation predicts only m0; for a sensor on another mass, collisions are found without it.
    specimen = known_specimen(facts.bench) if facts.mass == "m0" else None
    response, picture = measured_sweep(channels, plan, specimen)
    colliding = collisions(response)
    jumps = smooth_jumps(response, colliding)
    checks = (*measurement_checks(facts), played_check(response, plan))
    return SweepAnalysis(facts, checks, plan, response, colliding, jumps, picture)


def _draws(analysis: SweepAnalysis) -> Callable[[SimulatedChannels], Draw[SweptMotion]]:
    swept = SweepDraws(analysis.excitation, known_specimen(analysis.facts.bench))

    def draw(channels: SimulatedChannels) -> Draw[SweptMotion]:
        found = swept.motion(channels)
        colliding = collisions(found)
        impacts = channels.played_impacts(SegmentLabel.SWEEP)
        return Draw(lambda: found, sweep_quantities(found, colliding), sweep_endings(colliding), *impacts)

    return draw


SWEEP = AnalysisKind(
    family="sweep",
    analyse=_analyse,
    draws=_draws,
    compared=lambda analysis: sweep_quantities(analysis.response, analysis.collisions),
    lay=sweep_overlay,
    curves=sweep_traces,
    budgets=sweep_budgets,
)
