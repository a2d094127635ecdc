"""Noise: the transmission from base to m0, its resonances, and what JSON says of them."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np

from vibench.acquisition.recording import SegmentLabel

from ..comparison.recording_curves import noise_traces
from ..frequency_response.distortion import distortion
from ..frequency_response.mode import Resonance
from ..frequency_response.noise_response import (
    Noise,
    NoiseAnalysis,
    NoiseResponse,
    repeated_response,
    streamed_response,
)
from ..frequency_response.periodic import PeriodicFrequencyResponse
from ..frequency_response.request import FrequencyResponseRequest
from ..model.draws import Draw
from ..model.overlay import NoiseOverlay, noise_overlay, noise_quantities
from ..model.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels
from ..recordings.checks import Check, Verdict, measurement_checks
from ..recordings.facts import RecordingFacts
from ..tables import named
from ..uncertainty.quantities import noise_budgets
from .analysis_kind import AnalysisKind, Json

NOISE_FAMILY = "noise"
Estimate = Callable[[Channels, Any, FrequencyResponseRequest], NoiseResponse]


def _measured(analysis: NoiseAnalysis) -> Json:
    found = analysis.response
    return {
        "resonances": [_resonance(each) for each in found.resonances],
        "transmission": _frequency_response(analysis),
        "distortion": None if found.periodic is None else _distortion(found.periodic),
        "independent_averages": found.frequency_response.n_eff,
        **named(found, "used_s", "left_out", "lost_samples", "overloaded_samples"),
        "median_coherence": float(np.median(found.frequency_response.coherence)),
        "base_rms_acceleration_m_per_s2": found.base_level.rms_acceleration,
        "base_rms_displacement_m": found.base_level.rms_displacement_m,
        "relative_sd_base_rms": found.base_level.relative_sd,
    }


def _frequency_response(analysis: NoiseAnalysis) -> Json:
    view = analysis.request.view
    found = view.shown(analysis.response.frequency_response)
    how = found.settings
    return {
        "quantity": view.name,
        "unit": view.unit,
        "estimator": how.estimator.value,
        "noise_ratio": how.noise_ratio,
        "window": how.window,
        "segment_s": how.segment_samples / how.sample_rate_hz,
        "overlap": how.overlap,
        **named(found, "resolution_hz", "segments_used", "segments_excluded"),
        "delay_removed_s": how.delay_s,
        "confidence": how.confidence,
        **named(found, "coherence_significance", "frequency_hz", "magnitude"),
        **named(found, "magnitude_lower", "magnitude_upper", "phase_rad"),
        "phase_lower_rad": found.phase_lower_rad,
        "phase_upper_rad": found.phase_upper_rad,
        "coherence": found.coherence,
        "is_significant": found.is_significant,
    }


def _distortion(periodic: PeriodicFrequencyResponse) -> Json:
    found = distortion(periodic)
    return {
        "realisations": periodic.realisations,
        "median_not_repeating_over_magnitude": found.noise_share,
        "median_distortion_over_magnitude": found.distortion_share,
        "gain_drift": periodic.drift and periodic.drift.gain_share,
        "frequency_drift": periodic.drift and periodic.drift.frequency_share,
        "odd_detection_lines_m_per_s": found.odd_m_per_s,
        "even_detection_lines_m_per_s": found.even_m_per_s,
        "noise_on_detection_lines_m_per_s": found.detection_noise_m_per_s,
    }


def _resonance(found: Resonance) -> Json:
    return {
        **named(found, "frequency_hz", "sd_frequency_hz", "damping_ratio", "sd_damping_ratio"),
        **named(found, "peak_frequency_hz", "peak_magnitude", "sd_peak_magnitude"),
        **named(found, "reduced_chi_square", "chi_square_limit", "remark"),
        "is_resolved": bool(found.is_resolved),
    }


def _warnings(found: NoiseResponse) -> Iterator[Check]:
    """Warn of resonances that the fit does not describe, of a biased estimator and of drift."""
    drift = found.periodic and found.periodic.drift
    for what, remarks in (
        ("Resonances", [each.remark for each in found.resonances]),
        ("Estimator", [found.bias]),
        ("Drift", [drift.text] if drift else []),
    ):
        if any(remarks):
            yield Check(what, Verdict.WARNING, "; ".join(filter(None, remarks)))


def _simulated(laid: NoiseOverlay) -> Json:
    return {"resonances": [_resonance(each) for each in laid.response.resonances]}


def _noise(
    estimate: Estimate, again: Callable[[NoiseAnalysis], Estimate]
) -> AnalysisKind[Noise, NoiseAnalysis, NoiseOverlay]:
    def analyse(
        facts: RecordingFacts, channels: Channels, plan: Noise, request: FrequencyResponseRequest
    ) -> NoiseAnalysis:
        response = estimate(channels, plan, request)
        checks = (*measurement_checks(facts), *_warnings(response))
        return NoiseAnalysis(facts, checks, plan, response, request)

    def draw(analysis: NoiseAnalysis, channels: SimulatedChannels) -> Draw[NoiseResponse]:
        response = again(analysis)(channels, analysis.excitation, analysis.request)
        label = SegmentLabel.NOISE if response.periodic is None else SegmentLabel.REALISATION
        return Draw(response, noise_quantities(response), (), *channels.played_impacts(label))

    return AnalysisKind(
        family=NOISE_FAMILY,
        analyse=analyse,
        draw=draw,
        compared=lambda analysis: noise_quantities(analysis.response),
        lay=noise_overlay,
        curves=noise_traces,
        measured=_measured,
        simulated=_simulated,
        budgets=noise_budgets,
        place=lambda plan: (plan.amplitude_vpp,),
    )


def _repeated_again(analysis: NoiseAnalysis) -> Estimate:
    """Give the estimate for draws: their drive is the recorded one, whose periods were measured with it."""
    found = analysis.response
    if found.periodic is None or found.left_out:
        return repeated_response
    return partial(repeated_response, repetitions=found.periodic.repetitions)


REPEATED_NOISE = _noise(repeated_response, again=_repeated_again)
STREAMED_NOISE = _noise(streamed_response, again=lambda _: streamed_response)
