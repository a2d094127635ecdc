"""Analysis of noise: the transmission from base to m0, and its resonances."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

from vibench.acquisition.recording import SegmentLabel

from ..comparison.recording_curves import noise_traces
from ..frequency_response.noise_response import (
    Estimated,
    Noise,
    NoiseAnalysis,
    NoiseResponse,
    repeated_response,
    streamed_response,
)
from ..frequency_response.request import FrequencyResponseRequest
from ..overlay.draws import Draw
from ..overlay.overlay import NoiseOverlay, noise_overlay, noise_quantities
from ..overlay.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels
from ..recordings.checks import Check, Verdict, measurement_checks
from ..recordings.facts import RecordingFacts
from ..uncertainty.quantities import noise_budgets
from .analysis_kind import AnalysisKind

NOISE_FAMILY = "noise"
Estimate = Callable[[Channels, Any, FrequencyResponseRequest], Estimated]


def _warnings(found: NoiseResponse) -> Iterator[Check]:
    """Warn of poor fits of resonances, of a biased estimator, of drift and of a single hit."""
    drift = found.periodic and found.periodic.drift
    alone = "only one hit was recorded, so scatter is unknown and no result has bounds; hit at least 5 times"
    for what, remarks in (
        ("Resonances", [each.remark for each in found.resonances]),
        ("Estimator", [found.bias]),
        ("Drift", [drift.text] if drift else []),
        ("Hits", [alone] if found.hits == 1 else []),
    ):
        if any(remarks):
            yield Check(what, Verdict.WARNING, "; ".join(filter(None, remarks)))


def _noise(
    estimate: Estimate, again: Callable[[NoiseAnalysis], Estimate]
) -> AnalysisKind[Noise, NoiseAnalysis, NoiseOverlay]:
    def analyse(
        facts: RecordingFacts, channels: Channels, plan: Noise, request: FrequencyResponseRequest
    ) -> NoiseAnalysis:
        _, whole = estimate(channels, plan, request)
        response = whole()
        checks = (*measurement_checks(facts), *_warnings(response))
        return NoiseAnalysis(facts, checks, plan, response, request)

    def draw(analysis: NoiseAnalysis, channels: SimulatedChannels) -> Draw[NoiseResponse]:
        found, whole = again(analysis)(channels, analysis.excitation, analysis.request)
        label = SegmentLabel.NOISE if analysis.response.periodic is None else SegmentLabel.REALISATION
        return Draw(whole, noise_quantities(found), (), *channels.played_impacts(label))

    return AnalysisKind(
        family=NOISE_FAMILY,
        analyse=analyse,
        draws=lambda analysis: partial(draw, analysis),
        compared=lambda analysis: noise_quantities(analysis.response.frequency_response),
        lay=noise_overlay,
        curves=noise_traces,
        budgets=noise_budgets,
        place=lambda plan: (plan.amplitude_vpp,),
    )


def _estimate_for_draws(analysis: NoiseAnalysis) -> Estimate:
    """Return the estimator for simulated records; their drive is the recorded one, whose period is known."""
    found = analysis.response
    if found.periodic is None or found.left_out:
        return repeated_response
    return partial(repeated_response, repetitions=found.periodic.repetitions)


def _estimate_streamed(channels: Channels, plan: Any, request: FrequencyResponseRequest) -> Estimated:
    found = streamed_response(channels, plan, request)
    return found.frequency_response, lambda: found


REPEATED_NOISE = _noise(repeated_response, again=_estimate_for_draws)
STREAMED_NOISE = _noise(_estimate_streamed, again=lambda _: _estimate_streamed)
