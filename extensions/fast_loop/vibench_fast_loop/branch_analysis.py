"""Analysis of a branch held by a fast loop, as for stepped sines but without a simulation."""

from collections.abc import Callable
from dataclasses import replace
from math import nan

from vibench.acquisition.recording import SegmentLabel
from vibench.analysis.errors import UnusableData
from vibench.analysis.kinds import stepped_analysis
from vibench.analysis.overlay.draws import Draw
from vibench.analysis.overlay.driven_rig import SimulatedChannels
from vibench.analysis.sine.stepped_response import SteppedResponse, SteppedSineAnalysis


def _refuse_draws(_: SteppedSineAnalysis) -> Callable[[SimulatedChannels], Draw[SteppedResponse]]:
    raise UnusableData(
        "the branch was not simulated: a fast loop held its motions, which the model, driven by the recorded "
        "voltage alone, would leave; compare the motions with the branch of the model"
    )


# A branch is not a curve over frequency, because it may have several motions at one frequency.
BRANCH_CONTINUATION = replace(
    stepped_analysis(lambda *_: nan, SegmentLabel.BRANCH), draws=_refuse_draws, curves=lambda *_: iter(())
)
