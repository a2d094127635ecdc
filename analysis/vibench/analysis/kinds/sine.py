"""Analysis of sweeps, dwells and stepped sines: responses, collisions, kind of motion."""

from collections.abc import Callable
from functools import partial
from math import inf, nan

import numpy as np

from vibench.acquisition.recording import SegmentLabel

from ..chaos.verdict import MotionKind
from ..comparison.recording_curves import dwell_traces, stepped_traces, sweep_traces
from ..frequency_response.request import FrequencyResponseRequest
from ..overlay.draws import Draw
from ..overlay.ensemble import Ending
from ..overlay.overlay import (
    SteppedSineOverlay,
    dwell_overlay,
    dwell_quantities,
    sine_quantities,
    stepped_overlay,
    sweep_endings,
    sweep_overlay,
    sweep_quantities,
)
from ..overlay.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels, Stretch
from ..recordings.checks import measurement_checks
from ..recordings.facts import RecordingFacts, known_specimen
from ..sine.collision_region import collisions
from ..sine.dwell import DwellResponse
from ..sine.dwell_analysis import (
    WINDOW_S,
    DwellAnalysis,
    DwellPlan,
    IrregularMotion,
    bound_frequencies_hz,
    dwell_motion,
    dwell_section,
    irregular_motion,
    measured_dwell,
    settled_envelope,
    terminal_levels,
)
from ..sine.jumps import SteppedLevelAnalysis
from ..sine.stepped_response import (
    SteppedResponse,
    SteppedSineAnalysis,
    Steps,
    settled_check,
    stepped_response,
)
from ..sine.sweep import SweptMotion
from ..sine.sweep_analysis import (
    Sweep,
    SweepAnalysis,
    SweepDraws,
    frequency_check,
    measured_sweep,
    played_check,
    smooth_jumps,
)
from ..uncertainty.quantities import dwell_budgets, stepped_budgets, sweep_budgets
from .analysis_kind import AnalysisKind


def _analyse_sweep(
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
    analyse=_analyse_sweep,
    draws=_draws,
    compared=lambda analysis: sweep_quantities(analysis.response, analysis.collisions),
    lay=sweep_overlay,
    curves=sweep_traces,
    budgets=sweep_budgets,
)


def _analyse_dwell(
    facts: RecordingFacts, channels: Channels, plan: DwellPlan, _: FrequencyResponseRequest
) -> DwellAnalysis:
    towards_hz = bound_frequencies_hz(facts)
    # A dwell recorded until its bounds were small enough (`until` in its plan) is analysed as a whole.
    longest_s = WINDOW_S if facts.measurement.until is None else inf
    found = measured_dwell(channels, plan, towards_hz, longest_s)
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
        irregular=irregular_motion(motion.section, found, channels.sample_rate_hz),
    )


def _endings(found: IrregularMotion | None) -> tuple[Ending, ...]:
    if found is None:
        return ()
    return (Ending("irregular motion", found.start_s, found.stop_s, found.ended),)


def _draw(analysis: DwellAnalysis, channels: SimulatedChannels) -> Draw[DwellResponse]:
    towards_hz = bound_frequencies_hz(analysis.facts)
    found = measured_dwell(channels, analysis.excitation, towards_hz, analysis.response.window_s)
    endings = _endings(irregular_motion(dwell_section(channels, found), found, channels.sample_rate_hz))
    impacts = channels.played_impacts(SegmentLabel.DWELL)
    return Draw(lambda: found, dwell_quantities(found, towards_hz, endings), endings, *impacts)


DWELL = AnalysisKind(
    family="dwell",
    analyse=_analyse_dwell,
    draws=lambda analysis: partial(_draw, analysis),
    compared=lambda analysis: dwell_quantities(
        analysis.response, bound_frequencies_hz(analysis.facts), _endings(analysis.irregular)
    ),
    lay=lambda analysis, drawn: dwell_overlay(analysis, drawn, _endings(analysis.irregular)),
    curves=dwell_traces,
    budgets=dwell_budgets,
    place=lambda plan: (plan.frequency_hz, plan.amplitude_vpp),
)


Setting = Callable[[Steps, Stretch], float]


def stepped_analysis(
    setting_vpp: Setting,
    label: SegmentLabel = SegmentLabel.STEP,
    result: type[SteppedSineAnalysis] = SteppedSineAnalysis,
) -> AnalysisKind[Steps, SteppedSineAnalysis, SteppedSineOverlay]:
    """Return the analysis of a kind that records each step in a segment called ``label``."""

    def analyse(
        facts: RecordingFacts, channels: Channels, plan: Steps, _: FrequencyResponseRequest
    ) -> SteppedSineAnalysis:
        response = stepped_response(channels, plan, label, setting_vpp)
        planned_hz = np.array(
            [each.numbers["frequency_hz"] for each in channels.stretches(label)], dtype=float
        )
        frequency = frequency_check(response.frequency_hz, planned_hz)
        checks = (*measurement_checks(facts), frequency, settled_check(response))
        return result(facts, checks, plan, response)

    def draw(analysis: SteppedSineAnalysis, channels: SimulatedChannels) -> Draw[SteppedResponse]:
        response = stepped_response(channels, analysis.excitation, label, setting_vpp)
        found = sine_quantities(response, response.frequency_hz)
        return Draw(lambda: response, found, (), *channels.played_impacts(label))

    return AnalysisKind(
        family="stepped_sine",
        analyse=analyse,
        draws=lambda analysis: partial(draw, analysis),
        compared=lambda analysis: sine_quantities(analysis.response, analysis.response.frequency_hz),
        lay=stepped_overlay,
        curves=stepped_traces,
        budgets=stepped_budgets,
    )


STEPPED_SINE = stepped_analysis(lambda plan, _: plan.amplitude_vpp)
STEPPED_LEVEL = stepped_analysis(
    lambda _, stretch: float(stretch.numbers["amplitude_vpp"]), result=SteppedLevelAnalysis
)
# With feedback the generator voltage differs from the plan and is not known for each step.
SETTLED_SINE = stepped_analysis(lambda *_: nan)
RESONANCE_TRACKING = stepped_analysis(lambda *_: nan, SegmentLabel.RESONANCE)
