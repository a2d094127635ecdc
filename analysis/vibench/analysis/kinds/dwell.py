"""Dwells: both responses, the lines of the spectrum, how the motion repeats, and what JSON says of them."""

import numpy as np

from vibench.acquisition.recording import SegmentLabel

from ..chaos.verdict import MotionKind, MotionVerdict
from ..comparison.recording_curves import dwell_traces
from ..frequency_response.request import FrequencyResponseRequest
from ..model.draws import Draw, Drawn
from ..model.ensemble import Quantity
from ..model.escape import Ending
from ..model.overlay import DwellOverlay, dwell_overlay, dwell_quantities
from ..model.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels
from ..recordings.checks import measurement_checks
from ..recordings.facts import RecordingFacts
from ..sine.dwell import DwellResponse
from ..sine.dwell_analysis import (
    DwellAnalysis,
    DwellPlan,
    TerminalLevel,
    bound_frequencies_hz,
    measured_dwell,
    settled_envelope,
    terminal_levels,
)
from ..sine.dwell_motion import IrregularMotion, dwell_motion, irregular_motion
from ..sine.sweep_analysis import frequency_check
from ..tables import named
from ..uncertainty.quantities import dwell_budgets
from .analysis_kind import AnalysisKind, Json


def _analyse(
    facts: RecordingFacts, channels: Channels, plan: DwellPlan, _: FrequencyResponseRequest
) -> DwellAnalysis:
    towards_hz = bound_frequencies_hz(facts)
    found = measured_dwell(channels, plan, towards_hz)
    motion = dwell_motion(channels, found)
    if motion.verdict.kind not in {MotionKind.CHAOTIC, MotionKind.QUASI_PERIODIC}:
        found = found.with_rest_as_noise(is_known_to_repeat=motion.verdict.kind is MotionKind.PERIODIC)
    frequency = frequency_check(np.array([found.drive.frequency_hz]), np.array([plan.frequency_hz]))
    return DwellAnalysis(
        facts=facts,
        checks=(*measurement_checks(facts), frequency),
        excitation=plan,
        response=found,
        displacement=settled_envelope(found),
        terminal=terminal_levels(found, towards_hz),
        motion=motion,
        irregular=irregular_motion(channels, found),
    )


def _endings(found: IrregularMotion | None) -> tuple[Ending, ...]:
    if found is None:
        return ()
    return (Ending("irregular motion", found.start_s, found.stop_s, found.ended),)


def _draw(analysis: DwellAnalysis, channels: SimulatedChannels) -> Draw[DwellResponse]:
    towards_hz = bound_frequencies_hz(analysis.facts)
    found = measured_dwell(channels, analysis.excitation, towards_hz)
    endings = _endings(irregular_motion(channels, found))
    impacts = channels.played_impacts(SegmentLabel.DWELL)
    return Draw(found, dwell_quantities(found, towards_hz, endings), endings, *impacts)


def _compared(analysis: DwellAnalysis) -> tuple[Quantity, ...]:
    towards_hz = bound_frequencies_hz(analysis.facts)
    return dwell_quantities(analysis.response, towards_hz, _endings(analysis.irregular))


def _lay(analysis: DwellAnalysis, drawn: Drawn[DwellResponse]) -> DwellOverlay:
    return dwell_overlay(analysis, drawn, _endings(analysis.irregular))


def _measured(analysis: DwellAnalysis) -> Json:
    found = analysis.response
    return {
        "frequency_hz": found.drive.frequency_hz,
        "sd_frequency_hz": found.drive.sd_frequency_hz,
        "drive_amplitude_m": found.drive.amplitude_m,
        "sd_drive_amplitude_m": found.drive.sd_amplitude_m,
        "drive_distortion": found.drive.distortion,
        **named(found, "window_s", "response_i", "noise_bias_i", "noise_error_i"),
        **named(found, "noise_source", "response_ii"),
        **named(found, "sd_response_ii", "slow_change", "phase_rad", "sd_phase_rad"),
        "lines": [
            {
                **named(each, "label", "frequency_hz", "amplitude_m", "sd_amplitude_m"),
                "decibel_re_drive_line": each.decibel,
            }
            for each in found.lines
        ],
        "terminal_bands": [_band(each) for each in analysis.terminal],
        "motion": _motion(analysis.motion.verdict),
    }


def _motion(verdict: MotionVerdict) -> Json:
    evidence = verdict.evidence
    return {
        "kind": verdict.kind.value,
        "why": verdict.why,
        "period": verdict.period,
        "periods_judged": evidence.periods,
        "is_settled": evidence.is_settled,
        "scatter_over_orbit": evidence.spread,
        "noise_over_orbit": evidence.noise,
        "zero_one_k": None if evidence.zero_one is None else evidence.zero_one.k,
        "surrogates_p": None if evidence.surrogates is None else evidence.surrogates.p,
        "turns_per_period": None if evidence.rotation is None else evidence.rotation.turns_per_period,
        "least_lyapunov_per_s": verdict.least_exponent_per_s,
    }


def _band(found: TerminalLevel) -> Json:
    return {
        **named(found, "towards_hz", "low_hz", "high_hz", "peak_hz", "rms_m", "relative_sd"),
        "decibel_re_drive_line": found.decibel,
    }


def _simulated(laid: DwellOverlay) -> Json:
    return {
        **named(laid.response, "response_i", "response_ii", "sd_response_ii"),
        "terminal_bands": [_band(each) for each in laid.terminal],
    }


DWELL = AnalysisKind(
    family="dwell",
    analyse=_analyse,
    draw=_draw,
    compared=_compared,
    lay=_lay,
    curves=dwell_traces,
    measured=_measured,
    simulated=_simulated,
    budgets=dwell_budgets,
    place=lambda plan: (plan.frequency_hz, plan.amplitude_vpp),
)
