"""Notes of a feedback controller in older recordings are read as values and written unchanged."""

import pytest

from vibench.acquisition.errors import RecordingError
from vibench.acquisition.recording import (
    DwellNote,
    ExcursionNote,
    Hold,
    JumpNote,
    JumpSearchEnd,
    LevelNote,
    LockResult,
    ResonanceNote,
    SegmentLabel,
    SegmentNote,
    SettledNote,
    Steadiness,
    SweepNote,
    feedback_note,
)
from vibench.acquisition.recording._layout import TEXT_WIDTH
from vibench.acquisition.recording._tables import Event

# Copied from recordings of November 2026.
LOST = (
    '{"level": 0, "asked_m_per_s2": 0.5, "frequency_hz": null, "frequency_u_hz": null, "at_hz": 265.205, '
    '"phase_deg": -75.1097, "response_ii": 22.2421, "base_m_per_s2": 0.501311, "base_u": 0.000104905, '
    '"held": "within tolerance", "motion": "periodic", "tries": 2, "lock": "outside the range"}'
)
TRACKED = (
    '{"level": 0, "asked_m_per_s2": 0.5, "frequency_hz": 266.377, "frequency_u_hz": 0.023934, "at_hz": '
    '266.418, "phase_deg": -90.5296, "response_ii": 22.5615, "base_m_per_s2": 0.50069, "base_u": '
    '0.000175681, "held": "within tolerance", "motion": "periodic", "tries": 3, "lock": "locked", '
    '"mode_hz": 266.177, "mode_u_hz": 0.00857796, "damping_ratio": 0.0167262}'
)
STEP = (
    '{"segment": "step", "frequency_hz": 196.0, "drive_hz": 196.00333131486497, "base_m_per_s2": 4.53055, '
    '"base_u": 0.000139043, "level": "within tolerance", "response_ii": 1.87163, "motion": "periodic", '
    '"period": 1}'
)
SETTLED = (
    '{"frequency_hz": 260.0, "motion": "unsettled", "period": 0, "waited_s": 2.8, "scatter": 0.701965, '
    '"noise": 0.000234372, "setting_vpp": 0.288824, "base_m_per_s2": 8.03211, "base_u": 0.164312, '
    '"level": "not controlled"}'
)
JUMP = (
    '{"direction": "down", "pass": 2, "frequency_hz": 101.094, "before_hz": 101.25, "after_hz": 100.9375, '
    '"response_before": 3.1, "response_after": 1.2, "how": "steep, but no jump", "arrived": "after"}'
)
LEVEL = (
    '{"at_s": 1.0, "base_m_per_s2": 8.07387, "base_u": 0.130971, "setting_vpp": 0.288824, '
    '"level": "outside tolerance"}'
)
EXCURSION = '{"from_hz": 254.8, "to_hz": 258.8, "worst": 0.212426, "level": "outside tolerance"}'
DWELL = '{"segment": "dwell", "looks": 3, "looks_outside": 0}'
SWEEP = '{"segment": "sweep", "steps": 50, "steps_outside": 15, "average_s": 0.5}'
WRITTEN = [
    ("resonance", LOST, ResonanceNote),
    ("resonance", TRACKED, ResonanceNote),
    ("achieved", STEP, SegmentNote),
    ("settled", SETTLED, SettledNote),
    ("jump", JUMP, JumpNote),
    ("level", LEVEL, LevelNote),
    ("level", EXCURSION, ExcursionNote),
    ("achieved", DWELL, DwellNote),
    ("achieved", SWEEP, SweepNote),
]


def read(kind, text):
    return feedback_note(Event(512, 0.0, kind, text))


@pytest.mark.parametrize(("kind", "text", "form"), WRITTEN)
def test_a_feedback_note_of_an_older_recording_round_trips(kind, text, form):
    note = read(kind, text)
    assert type(note) is form
    assert (note.kind, note.text) == (kind, text)
    assert len(text) <= TEXT_WIDTH, "it is not cut in the file"


def test_the_text_of_a_feedback_note_is_parsed_into_values():
    assert read("achieved", STEP).segment is SegmentLabel.STEP
    assert read("achieved", STEP).level is Hold.WITHIN
    assert read("settled", SETTLED).motion is Steadiness.UNSETTLED
    assert read("jump", JUMP).how is JumpSearchEnd.STEEP
    assert read("jump", JUMP).pass_number == 2
    assert read("resonance", LOST).lock is LockResult.AT_THE_EDGE
    older = LOST.replace("outside the range", "not met within the tries")
    assert read("resonance", older).lock is LockResult.LOST
    assert read("resonance", LOST).mode_hz is None


def test_events_of_other_kinds_and_truncated_notes_are_ignored():
    assert read("check", "skipped: the bench was checked shortly before") is None
    assert read("settled", SETTLED[:100] + "…") is None


@pytest.mark.parametrize("more", ['"version": 2, ', '"version": 2, "bandwidth_hz": 0.1, '])
def test_a_note_of_an_unknown_version_is_refused_and_the_version_is_named(more):
    with pytest.raises(
        RecordingError, match=r"'level' at sample 512 \(version 2\) .* version 1\); read .* h5py"
    ):
        read("level", LEVEL.replace("{", "{" + more))


def test_numbers_in_feedback_notes_have_six_digits():
    note = ExcursionNote(from_hz=254.8123456, to_hz=258.8, worst=-0.2124261234, level=Hold.OUTSIDE)
    assert (note.from_hz, note.worst) == (254.812, -0.212426)
