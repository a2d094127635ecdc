"""Feedback notes in a recording become numbers and sentences."""

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.analysis.virtual_measurements import record, sampled_at
from vibench.acquisition.plan import ResonanceTracking, SettledSine
from vibench.acquisition.recording import Hold, JumpNote, JumpSearchEnd, JumpSide, SegmentNote, Steadiness
from vibench.analysis import CampaignResults, analyse, result_summary
from vibench.analysis.kinds import Result
from vibench.analysis.report import findings, result_figures
from vibench.analysis.report._stepped_sine import (
    STEPPED_FREQUENCIES,
    TRACKED_RESONANCE,
    backbone_figure,
    stepped_sine_figure,
)
from vibench.analysis.sine.stepped_response import feedback_sentences, noted_jumps

JUMP = JumpNote(
    direction="down",
    pass_number=1,
    frequency_hz=101.09375,
    before_hz=101.25,
    after_hz=100.9375,
    response_before=3.0,
    response_after=1.0,
    how=JumpSearchEnd.LOCALISED,
    arrived=JumpSide.AFTER,
)
STEP = SegmentNote(
    segment="step",
    frequency_hz=100.0,
    drive_hz=100.0,
    base_m_per_s2=1.0,
    base_u=0.01,
    level=Hold.WITHIN,
    response_ii=2.0,
    motion=Steadiness.PERIODIC,
    period=1,
)


def test_only_jumps_with_a_bracket_are_counted():
    steep = JUMP.model_copy(update={"how": JumpSearchEnd.STEEP})
    assert noted_jumps([JUMP, steep]) == ((100.9375, 101.25, "down"),)
    assert list(feedback_sentences([JUMP])) == ["Jumps between 100.94 and 101.25 Hz (down)."]


def test_recorded_steps_are_counted_by_kind_of_motion():
    tripled = STEP.model_copy(update={"period": 3})
    chaotic = STEP.model_copy(update={"motion": Steadiness.APERIODIC, "period": 0, "level": Hold.OUTSIDE})
    said = list(feedback_sentences([STEP, tripled, tripled, chaotic]))
    assert said == [
        "4 recorded motions, by kind: period 3: 2, no period: 1.",
        "The base level was out of tolerance in 1 of 4 recorded motions.",
    ]


def test_recordings_without_feedback_give_no_feedback_sentence():
    assert list(feedback_sentences(())) == []


@pytest.fixture
def record_and_analyse(tmp_path):
    """Return a function that records an excitation on the virtual rig and analyses the recording."""

    def analysis_of(excitation):
        return analyse(record(tmp_path / "run.h5", excitation, sampled_at(10240.0), ramp_s=0.4))

    return analysis_of


@pytest.mark.thorough
def test_a_tracked_resonance_is_analysed_and_reported(record_and_analyse):
    tracked = ResonanceTracking(
        amplitude_vpp=0.2,
        start_hz=265,
        low_hz=250,
        high_hz=280,
        accelerations_m_per_s2=(0.5,),
        flank_pairs=2,
    )
    analysis = record_and_analyse(tracked)
    # Response II at 90 degrees lag is 22.58, estimated independently of the control loop.
    assert analysis.response.response_ii[0] == pytest.approx(22.58, rel=0.01)
    (sentence,) = feedback_sentences(analysis.facts.feedback)
    assert sentence.startswith("Phase resonance at 266.")
    assert "natural frequency 266.1" in sentence
    said = findings(CampaignResults("run", (Result(analysis, None),), ()))
    assert list(said) == [f"run: {sentence}"], "it is not a stepped sine"
    drawn = stepped_sine_figure(analysis, None, TRACKED_RESONANCE)
    assert drawn.title == "Tracked resonance, around 266.2 Hz"
    assert drawn.caption == f"Resonance tracked, number of base levels: 1. {sentence}"
    (figure,) = result_figures(CampaignResults("run", (Result(analysis, None),), ()))
    assert figure.name == "backbone_run", "what is stepped is the level"
    numbers = dict(figure.tables[0].columns)
    found = analysis.response
    assert numbers["amplitude_m"] == pytest.approx(found.response_ii * found.drive_amplitude_m, rel=0.01)
    assert numbers["base_m_per_s2"] == pytest.approx([0.5], rel=0.05)
    assert numbers["frequency_hz"] == pytest.approx(found.frequency_hz, abs=0.1)
    document = json.loads(json.dumps(result_summary(Result(analysis, None))))
    kinds = [each["kind"] for each in document["recording"]["feedback"]]
    assert kinds.count("resonance") == 1
    (note,) = (each for each in analysis.facts.feedback if each.kind == "resonance")
    above = note.model_copy(update={"level": 2, "base_m_per_s2": 3 * note.base_m_per_s2})
    unmet = {"level": 1, "asked_m_per_s2": 1.0, "frequency_hz": None, "frequency_u_hz": None}
    facts = replace(analysis.facts, feedback=(note, note.model_copy(update=unmet), above))
    drawn = backbone_figure(replace(analysis, facts=facts))
    lines = [next(each for each in axes.lines if len(each.get_xdata()) == 3) for axes in drawn.figure.axes]
    assert [np.isnan(each.get_xydata()[:, 1]).tolist() for each in lines] == [[False, True, False]] * 3


@pytest.mark.thorough
def test_settled_steps_are_analysed_like_any_stepped_sine(record_and_analyse):
    analysis = record_and_analyse(SettledSine(amplitude_vpp=0.05, frequencies_hz=(230, 240), record_s=0.5))
    assert analysis.response.left_out == 0
    assert analysis.response.response_ii == pytest.approx([3.21, 4.24], rel=0.02)
    assert analysis.response.direction == ("up", "up")
    assert "2 steps" in stepped_sine_figure(analysis, None, STEPPED_FREQUENCIES).caption
