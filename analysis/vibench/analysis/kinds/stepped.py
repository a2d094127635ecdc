"""Stepped sines: responses frequency by frequency or level by level."""

from collections.abc import Callable
from functools import partial
from math import nan

import numpy as np

from vibench.acquisition.recording import SegmentLabel

from ..comparison.recording_curves import stepped_traces
from ..frequency_response.request import FrequencyResponseRequest
from ..overlay.draws import Draw
from ..overlay.ensemble import Quantity
from ..overlay.overlay import SteppedSineOverlay, stepped_overlay, stepped_quantities
from ..overlay.simulated_channels import SimulatedChannels
from ..recordings.channels import Channels, Stretch
from ..recordings.checks import measurement_checks
from ..recordings.facts import RecordingFacts
from ..sine.jumps import SteppedLevelAnalysis
from ..sine.stepped_response import (
    SteppedResponse,
    SteppedSineAnalysis,
    Steps,
    settled_check,
    stepped_response,
)
from ..sine.sweep_analysis import frequency_check
from ..uncertainty.quantities import stepped_budgets
from .analysis_kind import AnalysisKind

Setting = Callable[[Steps, Stretch], float]


def _compared_quantities(analysis: SteppedSineAnalysis) -> tuple[Quantity, ...]:
    return stepped_quantities(analysis.response)


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
        return Draw(lambda: response, stepped_quantities(response), (), *channels.played_impacts(label))

    return AnalysisKind(
        family="stepped_sine",
        analyse=analyse,
        draws=lambda analysis: partial(draw, analysis),
        compared=_compared_quantities,
        lay=stepped_overlay,
        curves=stepped_traces,
        budgets=stepped_budgets,
    )


STEPPED_SINE = stepped_analysis(lambda plan, _: plan.amplitude_vpp)
STEPPED_LEVEL = stepped_analysis(
    lambda _, stretch: float(stretch.numbers["amplitude_vpp"]), result=SteppedLevelAnalysis
)
# With feedback the setting differs from the plan's and is unknown for each step.
SETTLED_SINE = stepped_analysis(lambda *_: nan)
RESONANCE_TRACKING = stepped_analysis(lambda *_: nan, SegmentLabel.RESONANCE)
