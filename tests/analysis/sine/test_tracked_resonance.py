"""The backbone and its stiffness statement follow from the notes of tracked resonances."""

import math

import pytest

from vibench.acquisition.recording import DwellNote, ResonanceNote, Steadiness
from vibench.analysis.sine.stepped_response import (
    backbone_sentence,
    feedback_sentences,
    lost_levels,
    tracked_resonances,
)


def note(number, base, frequency_hz, **more):
    numbers = {
        "level": number,
        "asked_m_per_s2": base,
        "frequency_hz": frequency_hz,
        "frequency_u_hz": 0.03,
        "at_hz": 100.0,
        "phase_deg": -90.0,
        "response_ii": 20.0,
        "base_m_per_s2": base,
        "base_u": 0.0,
        "held": "within tolerance",
        "motion": "periodic",
        "tries": 3,
        "lock": "locked",
    }
    return ResonanceNote(**numbers | more)


def lost_note(number, base):
    return note(number, base, None, frequency_u_hz=None, lock="outside the range")


def test_tracked_resonances_are_sorted_by_base_level():
    found = tracked_resonances([note(0, 2.0, 99.0), note(1, 1.0, 100.0, mode_hz=100.5, mode_u_hz=0.1)])
    assert [each.number for each in found] == [1, 0]
    assert [each.frequency_hz for each in found] == [100.0, 99.0]
    assert found[0].amplitude_m == pytest.approx(20.0 * 1.0 / (2 * math.pi * 100.0) ** 2)
    assert (found[0].mode_hz, found[1].mode_hz) == (100.5, None)


def test_a_level_at_which_the_resonance_was_lost_is_excluded_from_the_backbone():
    notes = [
        note(0, 1.0, 100.0),
        lost_note(1, 3.0),
        lost_note(2, 2.0),
        DwellNote(segment="dwell", looks=1, looks_outside=0),
    ]
    assert [each.number for each in tracked_resonances(notes)] == [0]
    assert lost_levels(notes) == (2.0, 3.0)
    assert tracked_resonances([lost_note(0, 1.0)]) == ()


def test_a_level_without_a_resonance_reports_its_periods_its_phase_and_its_frequency():
    missed = note(1, 0.3, None, frequency_u_hz=None, lock="not met", periods=150)
    moved = missed.model_copy(update={"phase_deg": -86.4, "at_hz": 96.351, "motion": Steadiness.UNSETTLED})
    met = note(2, 0.4, 98.6, periods=120)
    found, not_found = feedback_sentences([met, moved])
    assert found == "Phase resonance at 98.600 ± 0.060 Hz (0.4 m/s², 120 periods)."
    assert not_found == (
        "No phase resonance at 0.3 m/s²: not met; after 150 periods the phase was -86.4° at 96.351 Hz, "
        "the level was within tolerance, and the motion was unsettled."
    )


def test_a_superharmonic_resonance_is_named_and_its_harmonic_is_drawn():
    met, unmet = note(0, 8.0, 31.7, harmonic=3, harmonic_m=8e-8), lost_note(1, 9.0)
    found, not_found = feedback_sentences([met, unmet.model_copy(update={"harmonic": 3})])
    assert found == "Superharmonic 3:1 phase resonance at 31.700 ± 0.060 Hz (8 m/s²)."
    assert not_found.startswith("No superharmonic 3:1 phase resonance at 9 m/s²: outside the range;")
    (drawn,) = tracked_resonances([met])
    assert (drawn.amplitude_m, drawn.is_fundamental) == (8e-8, False)


def test_a_subharmonic_resonance_is_named_and_its_amplitude_is_drawn():
    met = note(0, 30.0, 192.4, subharmonic=2, harmonic_m=2e-6)
    (found,) = feedback_sentences([met])
    assert found == "Subharmonic 1:2 phase resonance at 192.400 ± 0.060 Hz (30 m/s²)."
    (drawn,) = tracked_resonances([met])
    assert (drawn.amplitude_m, drawn.is_fundamental) == (2e-6, False)
    louder = note(1, 33.0, 194.4, subharmonic=2, harmonic_m=2.2e-6)
    assert "the drive at phase resonance moves by +2.000" in backbone_sentence(
        tracked_resonances([met, louder])
    )


@pytest.mark.parametrize(
    ("strong_hz", "said"),
    [
        (101.0, "by +1.000 ± 0.085 Hz: the mode hardens."),
        (99.0, "by -1.000 ± 0.085 Hz: the mode softens."),
        (100.05, "neither softening nor hardening is significant."),
    ],
)
def test_softening_or_hardening_is_stated_only_if_it_exceeds_the_uncertainty(strong_hz, said):
    sentence = backbone_sentence(tracked_resonances([note(0, 0.5, 100.0), note(1, 2.0, strong_hz)]))
    assert sentence.startswith("From 0.5 to 2 m/s² the phase resonance moves by ")
    assert sentence.endswith(said)


def test_a_single_level_gives_no_sentence_on_the_backbone():
    assert backbone_sentence(tracked_resonances([note(0, 0.5, 100.0)])) == ""
