"""The summary sentences of a report are correct and short for every kind of result."""

from types import SimpleNamespace as Of

import numpy as np
import pytest

from vibench.analysis.chaos.verdict import MotionKind, MotionVerdict
from vibench.analysis.report import Agreement
from vibench.analysis.report._drawings import noise_findings
from vibench.analysis.report._report import MOST_WORDS, summary
from vibench.analysis.results.campaign_results import AnalysisFailure, FailedStep

YES, NO, OPEN = Agreement


def noise(vpp, *peaks_hz, band_hz=(50.0, 600.0), specimen="paper"):
    response = Of(
        resonances=tuple(Of(frequency_hz=each) for each in peaks_hz),
        frequency_response=Of(frequency_hz=np.array(band_hz)),
    )
    facts = Of(name=f"noise {vpp}", bench={"specimen": specimen}, feedback=())
    analysis = Of(excitation=Of(amplitude_vpp=vpp), response=response, facts=facts)
    return Of(kind="white_noise", analysis=analysis, overlay=None)


def dwell(vpp, kind, frequency_hz=260.0, period=None):
    verdict = MotionVerdict(kind, "it is so", evidence=None, period=period)
    facts = Of(bench={"specimen": "paper"}, feedback=())
    excitation = Of(amplitude_vpp=vpp, frequency_hz=frequency_hz)
    return Of(kind="dwell", analysis=Of(excitation=excitation, motion=Of(verdict=verdict), facts=facts))


def campaign(noise=(), dwells=(), failures=()):
    results = (*noise, *dwells)
    return Of(noise=noise, dwells=dwells, in_order=results, results=results, failures=failures)


def report(**parts):
    return summary(campaign(**parts), ())


def test_the_campaign_of_the_paper_is_reported_in_three_findings():
    results = campaign(
        (noise(0.05, 94.61, 266.2, 499.6), noise(1.0, 201.0), noise(10.0, 199.1, 428.5)),
        (dwell(0.05, MotionKind.PERIODIC), dwell(1.5, MotionKind.CHAOTIC), dwell(10.0, MotionKind.CHAOTIC)),
    )
    assert summary(results, [YES] * 6) == (
        "At 0.05 Vpp there are three resonances, at 94.6, 266.2 and 499.6 Hz. "
        "At 10 Vpp these resonances disappear, and two new ones appear at 199.1 and 428.5 Hz. "
        "At 260 Hz the motion is periodic at 0.05 Vpp and chaotic at 1.5 and 10 Vpp. "
        "The simulation agrees with all six recordings."
    )


@pytest.mark.parametrize(
    ("strong", "words"),
    [
        (noise(10.0, 94.5, 266.0), "At 10 Vpp, 94.5 and 266.0 Hz remain; 499.6 Hz disappears."),
        (noise(10.0, 95.0, 266.0, 499.0), "At 10 Vpp, 95.0, 266.0 and 499.0 Hz remain."),
        (noise(10.0), "At 10 Vpp there is no significant resonance."),
        (noise(10.0, 199.0), "At 10 Vpp these resonances disappear, and a new one appears at 199.0 Hz."),
        (noise(10.0, *range(110, 240, 10)), "these resonances disappear, and 13 new ones appear at 110.0"),
        (noise(10.0, 266.0, 428.0), "266.0 Hz remains; 94.6 and 499.6 Hz disappear; 428.0 Hz is new."),
        (noise(10.0, 199.0, band_hz=(150.0, 300.0)), "At 10 Vpp there is one resonance, at 199.0 Hz."),
    ],
)
def test_measured_changes_of_resonances_are_reported(strong, words):
    assert words in report(noise=(noise(0.05, 94.6, 266.2, 499.6), strong))


def test_the_summary_of_noise_without_a_resonance_states_which_modes_may_be_missed():
    (finding,) = noise_findings(noise(10.0, band_hz=np.arange(50.0, 600.0, 0.5)))
    assert finding.endswith("resonance; lines are 0.5 Hz apart, narrower modes may be missed.")


@pytest.mark.parametrize(
    "second", [noise(0.05, 201.0), noise(10.0, 201.0, specimen="another")], ids=["level", "specimen"]
)
def test_recordings_of_a_single_level_or_of_two_specimens_are_not_compared(second):
    words = report(noise=(noise(0.05, 94.6, 266.2), second))
    assert "gone" not in words
    assert words.count("noise 0.05: Noise at 0.05 Vpp: resonances at 94.6, 266.2 Hz.") == 1
    assert words.count("Vpp: resonance at 201.0 Hz.") == 1


def test_undecided_motions_are_named_and_long_lists_are_shortened():
    assert "undecided at 1 Vpp." in report(dwells=(dwell(1.0, MotionKind.UNDECIDED),) * 2), "up and down"
    assert report(dwells=(dwell(1.0, MotionKind.UNDECIDED),)) == "At 260 Hz the motion is undecided at 1 Vpp."
    many = tuple(dwell(1.0, MotionKind.PERIODIC, 200.0 + each) for each in range(50))
    words = report(dwells=many)
    assert len(words.split()) <= MOST_WORDS
    assert words.endswith("The table shows all results.")


@pytest.mark.parametrize(
    ("verdicts", "words"),
    [
        ([YES], "The simulation agrees with the recording."),
        ([YES, YES], "The simulation agrees with both recordings."),
        ([OPEN, OPEN], "Agreement with a simulation was not determined."),
        (
            [YES, YES, NO, OPEN],
            "the simulation agrees with two, disagrees with one and was not compared with one.",
        ),
        ([NO], "The simulation disagrees with the recording."),
    ],
)
def test_agreement_with_the_simulation_is_stated_for_every_mix_of_verdicts(verdicts, words):
    assert summary(campaign((noise(0.05, 94.6),)), verdicts).endswith(words)


def test_recordings_without_a_result_come_first_and_long_findings_are_shortened():
    failed = AnalysisFailure("x.h5", FailedStep.ANALYSIS, "broken")
    assert report(failures=(failed,)) == "One recording of one gave no result."
    many = tuple(noise(0.05, 94.6, 266.2, 499.6) for _ in range(40))
    words = summary(campaign(many, failures=(failed,)), [YES] * 40)
    assert len(words.split()) <= MOST_WORDS
    assert words.endswith("The table shows all results. The simulation agrees with all 40 recordings.")
