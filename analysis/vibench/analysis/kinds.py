"""Registry of analyses: one entry per kind of excitation, looked up by ``excitation.kind``.

An entry defines how a recording of the kind is analysed, how its simulation is overlaid, which curves a
comparison shows and what the JSON document contains. Kinds of one family share most of their entry. Drawings
and texts of results are in `report`, because `report` loads matplotlib.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from math import inf, nan
from typing import Any, Generic, TypeAlias, TypeVar

import numpy as np

from vibench.acquisition.instruments import PlugInKind
from vibench.acquisition.plan import Family, present_word, rows_by_kind
from vibench.acquisition.recording import SegmentLabel

from .chaos.verdict import MotionKind
from .comparison import Curve, CurveOrigin, dwell_traces, noise_traces, stepped_traces, sweep_traces
from .frequency_response.noise_response import (
    Estimated,
    Noise,
    NoiseAnalysis,
    NoiseResponse,
    implausible_static_ratio,
    repeated_response,
    streamed_response,
    unrelated_motion,
)
from .frequency_response.results import FrequencyResponseRequest
from .overlay.draws import Draw, DrawSet
from .overlay.driven_rig import SimulatedChannels
from .overlay.ensemble import Ending, Quantity
from .overlay.overlay import (
    AbstractOverlay,
    DwellOverlay,
    NoiseOverlay,
    SteppedSineOverlay,
    SweepOverlay,
    dwell_overlay,
    dwell_quantities,
    noise_overlay,
    noise_quantities,
    sine_quantities,
    stepped_overlay,
    sweep_endings,
    sweep_overlay,
    sweep_quantities,
)
from .recordings.channels import BASE, RecordedChannels, Stretch
from .recordings.checks import AbstractAnalysis, Check, Verdict, is_acceleration, measurement_checks
from .recordings.facts import RecordingFacts, known_specimen
from .sine import sweep_analysis
from .sine.dwell import DwellResponse
from .sine.dwell_analysis import (
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
    slow_line_check,
    terminal_levels,
)
from .sine.stepped_response import (
    SteppedLevelAnalysis,
    SteppedResponse,
    SteppedSineAnalysis,
    Steps,
    settled_check,
    stepped_response,
)
from .sine.sweep import SweptMotion
from .tables import Tabular
from .uncertainty.budget import Budget, dwell_budgets, noise_budgets, stepped_budgets, sweep_budgets

Json = dict[str, Any]
P = TypeVar("P")
A = TypeVar("A", bound=AbstractAnalysis[Any, Any])
L = TypeVar("L", bound=AbstractOverlay[Any])


@dataclass(frozen=True, eq=False)
class Result(Tabular, Generic[A, L]):
    """Analysis of a measurement and its comparison with the simulation."""

    analysis: A
    overlay: L | None

    @property
    def kind(self) -> str:
        """Kind of the excitation."""
        return self.analysis.facts.measurement.excitation.kind


AnyResult: TypeAlias = Result[Any, Any]
NoiseResult: TypeAlias = Result[NoiseAnalysis, NoiseOverlay]
SweepResult: TypeAlias = Result[sweep_analysis.SweepAnalysis, SweepOverlay]
DwellResult: TypeAlias = Result[DwellAnalysis, DwellOverlay]
SteppedSineResult: TypeAlias = Result[SteppedSineAnalysis, SteppedSineOverlay]


@dataclass(frozen=True)
class AnalysisKind(Generic[P, A, L]):
    """Functions that analyse recordings of one kind of excitation."""

    family: str
    """Name of the results in JSON; kinds with the same type of result share this name."""
    analyse: Callable[[RecordingFacts, RecordedChannels, P, FrequencyResponseRequest], A]
    draws: Callable[[A], Callable[[SimulatedChannels], Draw[Any]]]
    """Return the function that estimates the measured quantities from simulated channels."""
    compared: Callable[[A], tuple[Quantity, ...]]
    """Return the measured quantities that are compared with the simulated records (draws)."""
    lay: Callable[[A, DrawSet[Any]], L]
    """Return the overlay: the comparison of the analysis with all draws."""
    curves: Callable[[str, CurveOrigin, Any], Iterator[Curve]]
    """Yield curves of the measured or simulated response of the recording with this name."""
    budgets: Callable[[A, L | None], tuple[Budget, ...]]
    """Return uncertainty budgets of the main results."""
    place: Callable[[P], tuple[float, ...]] = lambda _: ()
    """Return the key by which results of a family are sorted from weak to strong; unsorted by default."""


NOISE_FAMILY = "noise"
Estimate = Callable[[RecordedChannels, Any, FrequencyResponseRequest], Estimated]


def _warnings(found: NoiseResponse) -> Iterator[Check]:
    """Warn of poor fits, of a biased estimator, of drift, of a switched drive and of a single hit."""
    drift = found.periodic and found.periodic.drift
    alone = "only one hit was recorded, so scatter is unknown and no result has bounds; hit at least 5 times"
    for what, remarks in (
        ("Resonances", [each.remark for each in found.resonances]),
        ("Coherence", [unrelated_motion(found.frequency_response)]),
        ("Estimator", [found.bias]),
        ("Drift", [drift.text] if drift else []),
        ("Steady drive", [found.unsteady]),
        ("Hits", [alone] if found.hits == 1 else []),
    ):
        if any(remarks):
            yield Check(what, Verdict.WARNING, "; ".join(filter(None, remarks)))


def _noise(
    estimate: Estimate, again: Callable[[NoiseAnalysis], Estimate]
) -> AnalysisKind[Noise, NoiseAnalysis, NoiseOverlay]:
    def analyse(
        facts: RecordingFacts, channels: RecordedChannels, plan: Noise, request: FrequencyResponseRequest
    ) -> NoiseAnalysis:
        _, whole = estimate(channels, plan, request)
        response = whole()
        checks = (*measurement_checks(facts), *_warnings(response))
        ratio = implausible_static_ratio(response)
        if ratio is not None and is_acceleration(BASE, facts.bench):
            text = (
                f"at low frequencies, the mass moved {ratio:.2g} times as far as the base. If only the base "
                f"carries it, check the scales, sensitivities and signs of {facts.response} and {BASE}"
            )
            checks += (Check("Scales", Verdict.WARNING, text),)
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
    """Return the estimator for simulated records; their drive is the recorded drive, of known period."""
    found = analysis.response
    if found.periodic is None or found.left_out:
        return repeated_response
    return partial(repeated_response, repetitions=found.periodic.repetitions)


def _estimate_streamed(channels: RecordedChannels, plan: Any, request: FrequencyResponseRequest) -> Estimated:
    found = streamed_response(channels, plan, request)
    return found.frequency_response, lambda: found


REPEATED_NOISE = _noise(repeated_response, again=_estimate_for_draws)
STREAMED_NOISE = _noise(_estimate_streamed, again=lambda _: _estimate_streamed)


def _analyse_sweep(
    facts: RecordingFacts, channels: RecordedChannels, plan: sweep_analysis.Sweep, _: FrequencyResponseRequest
) -> sweep_analysis.SweepAnalysis:
    # The linear simulation predicts only m0. If the sensor is on another mass, find collisions without it.
    specimen = known_specimen(facts.bench) if facts.mass == "m0" else None
    response, picture = sweep_analysis.measured_sweep(channels, plan, specimen)
    colliding = sweep_analysis.collisions(response)
    jumps = sweep_analysis.smooth_jumps(response, colliding)
    checks = (*measurement_checks(facts), sweep_analysis.played_check(response, plan))
    return sweep_analysis.SweepAnalysis(facts, checks, plan, response, colliding, jumps, picture)


def _draws(analysis: sweep_analysis.SweepAnalysis) -> Callable[[SimulatedChannels], Draw[SweptMotion]]:
    swept = sweep_analysis.SweepDraws(analysis.excitation, known_specimen(analysis.facts.bench))

    def draw(channels: SimulatedChannels) -> Draw[SweptMotion]:
        found = swept.motion(channels)
        colliding = sweep_analysis.collisions(found)
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
    facts: RecordingFacts, channels: RecordedChannels, plan: DwellPlan, _: FrequencyResponseRequest
) -> DwellAnalysis:
    towards_hz = bound_frequencies_hz(facts)
    # If the plan contains `until`, the dwell lasted until its bounds were small enough: analyse all of it.
    longest_s = WINDOW_S if facts.measurement.until is None else inf
    found = measured_dwell(channels, plan, towards_hz, longest_s)
    motion = dwell_motion(channels, found)
    if motion.verdict.kind not in {MotionKind.CHAOTIC, MotionKind.QUASI_PERIODIC}:
        found = found.with_rest_as_noise(is_known_to_repeat=motion.verdict.kind is MotionKind.PERIODIC)
    found_hz = np.array([found.drive.frequency_hz])
    checks = (
        *measurement_checks(facts),
        sweep_analysis.frequency_check(found_hz, np.array([plan.frequency_hz])),
    )
    checks += slow_line_check(found)
    if motion.verdict.kind is MotionKind.PERIODIC:  # other motions change by themselves
        checks += (settled_check("Dwell settled", found_hz, np.array([found.slow_change])),)
    return DwellAnalysis(
        facts=facts,
        checks=checks,
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
        facts: RecordingFacts, channels: RecordedChannels, plan: Steps, _: FrequencyResponseRequest
    ) -> SteppedSineAnalysis:
        response = stepped_response(channels, plan, label, setting_vpp)
        planned_hz = np.array(
            [each.numbers["frequency_hz"] for each in channels.stretches(label)], dtype=float
        )
        frequency = sweep_analysis.frequency_check(response.frequency_hz, planned_hz)
        settled = settled_check("Steps settled", response.frequency_hz, response.slow_change)
        checks = (*measurement_checks(facts), frequency, settled)
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
# With feedback, the plan does not contain the generator voltage of each step.
SETTLED_SINE = stepped_analysis(lambda *_: nan)
RESONANCE_TRACKING = stepped_analysis(lambda *_: nan, SegmentLabel.RESONANCE)


ANALYSES: Mapping[str, AnalysisKind[Any, Any, Any]] = rows_by_kind(
    {
        Family.NOISE: REPEATED_NOISE,
        Family.SWEEP: SWEEP,
        Family.DWELL: DWELL,
        Family.STEPPED: STEPPED_SINE,
    },
    {
        "streamed_noise": STREAMED_NOISE,
        "settled_sine": SETTLED_SINE,
        "stepped_level": STEPPED_LEVEL,
        "resonance_tracking": RESONANCE_TRACKING,
        "held_response": SETTLED_SINE,
    },
    PlugInKind.ANALYSIS,
)
"""Analyses, keyed by the kind of excitation."""
FAMILIES = tuple(each.family for each in (REPEATED_NOISE, SWEEP, DWELL, STEPPED_SINE))
"""Families of analyses in the order of a report; families of other packages follow."""


def family_of(plan: Mapping[str, Any]) -> str:
    """Return the family of analyses of a recording's plan; empty if its kind is unknown."""
    kind = present_word((plan.get("excitation") or {}).get("kind", ""))
    return ANALYSES[kind].family if kind in ANALYSES else ""
