"""Each kind of excitation is one registry entry that declares its properties."""

from typing import get_args

import numpy as np
import pytest
from pydantic import TypeAdapter

from vibench.acquisition.excitation.dwell import Dwell, HeldDwell
from vibench.acquisition.excitation.kinds import EXCITATION_KINDS, Excitation, excitation_text, present_word
from vibench.acquisition.excitation.noise import (
    HeldNoise,
    OddMultisine,
    SpectrumPoint,
    StreamedNoise,
    WhiteNoise,
)
from vibench.acquisition.excitation.plan import BaseLevel, Family, LeadIn
from vibench.acquisition.excitation.resonance_tracking import ResonanceTracking
from vibench.acquisition.excitation.sine_sweep import HeldSweep, SineSweep
from vibench.acquisition.excitation.stepped_sine import HeldResponse, SettledSine, SteppedLevel, SteppedSine
from vibench.acquisition.excitation.steps import (
    Approach,
    Direction,
    HeldAcceleration,
    RelativeSetting,
    RmsSetting,
)
from vibench.acquisition.recording import SegmentLabel

BranchContinuation = pytest.importorskip(
    "vibench_fast_loop.branch_continuation", reason="pip install -e extensions/fast_loop brings it"
).BranchContinuation
BAND = {"band_start_hz": 20, "band_stop_hz": 800}
MOVE = {"start_hz": 220, "stop_hz": 310, "duration_s": 6}
HELD = BaseLevel(displacement_m=5e-6)
WAY = (LeadIn(frequency_hz=250, amplitude_vpp=1),)
EXAMPLES = (
    WhiteNoise(amplitude_vpp=1, realisations=2, **BAND),
    StreamedNoise(amplitude_vpp=1, duration_s=2, **BAND),
    SineSweep(amplitude_vpp=1, hold="displacement", **MOVE),
    Dwell(amplitude_vpp=1, frequency_hz=260, duration_s=2, lead_in=WAY),
    SteppedSine(amplitude_vpp=1, frequencies_hz=(200, 210, 220)),
    SteppedLevel(amplitude_vpp=1, frequency_hz=260, lowest_vpp=0.5, step_vpp=0.25),
    OddMultisine(amplitude_vpp=1, realisations=2, **BAND),
    SettledSine(amplitude_vpp=1, frequencies_hz=(200, 210), direction="down", base_level=HELD),
    HeldSweep(amplitude_vpp=1, base_level=HELD, **MOVE),
    HeldDwell(amplitude_vpp=1, frequency_hz=260, duration_s=2, base_level=HELD),
    ResonanceTracking(
        amplitude_vpp=1, start_hz=262, low_hz=240, high_hz=290, accelerations_m_per_s2=(0.6, 0.3)
    ),
    HeldNoise(
        amplitude_vpp=1, realisations=2, spectrum=(SpectrumPoint(frequency_hz=20, density=0.01),), **BAND
    ),
    HeldResponse(amplitude_vpp=1, frequencies_hz=(200, 210), response_m=5e-6),
    BranchContinuation(amplitude_vpp=1, base_level=HELD, start_hz=94, low_hz=90, high_hz=118),
)
by_kind = {each.kind: each for each in EXAMPLES}
every_kind = pytest.mark.parametrize("excitation", EXAMPLES, ids=list(by_kind))


def test_the_excitation_union_and_the_registry_contain_the_same_plans():
    union = get_args(Excitation)[0]
    assert get_args(union) == tuple(kind.plan for kind in EXCITATION_KINDS.values())
    assert list(EXCITATION_KINDS) == list(by_kind)


@pytest.mark.parametrize("word", ["white_noise", "multisine_noise"])
def test_white_noise_is_also_accepted_under_its_name_from_version_0_1(word):
    read = TypeAdapter(Excitation).validate_python({"kind": word, "amplitude_vpp": 1, **BAND})
    assert read == WhiteNoise(amplitude_vpp=1, **BAND)
    assert (read.kind, present_word(word)) == ("white_noise", "white_noise")
    assert read.model_dump()["kind"] == "white_noise"


@every_kind
def test_every_recorded_segment_is_labelled_as_a_result_or_as_lead_in(excitation):
    labels = {step.segment.label for step in excitation.steps()}
    assert labels - {SegmentLabel.LEAD_IN} <= set(excitation.result_labels)
    assert excitation.family in Family


@every_kind
def test_the_stated_band_of_a_plan_contains_all_played_frequencies(excitation):
    low_hz, high_hz = excitation.band_hz
    tones = [step.play.frequency_hz for step in excitation.steps() if hasattr(step.play, "frequency_hz")]
    assert low_hz < high_hz
    assert all(low_hz <= each <= high_hz for each in (*tones, excitation.highest_frequency_hz))


def test_the_band_of_resonance_tracking_is_the_search_range():
    assert by_kind["resonance_tracking"].band_hz == (240, 290)


@pytest.mark.parametrize(
    ("kind", "level"),
    [
        ("white_noise", RmsSetting()),
        ("odd_multisine", RmsSetting()),
        ("streamed_noise", RmsSetting()),
        ("dwell", RelativeSetting(1.0)),
        ("stepped_sine", RelativeSetting(1.0)),
        ("stepped_level", RelativeSetting(1.0)),
        ("sine_sweep", RelativeSetting(pytest.approx((250 / 310) ** 2))),
        ("settled_sine", HeldAcceleration(pytest.approx(5e-6 * (2 * np.pi * 250) ** 2))),
        ("held_sweep", HeldAcceleration(pytest.approx(5e-6 * (2 * np.pi * 250) ** 2))),
        ("held_dwell", HeldAcceleration(pytest.approx(5e-6 * (2 * np.pi * 250) ** 2))),
        ("resonance_tracking", HeldAcceleration(0.6)),
        ("held_noise", RmsSetting()),
        ("held_response", RelativeSetting(1.0)),
        ("branch_continuation", HeldAcceleration(pytest.approx(5e-6 * (2 * np.pi * 250) ** 2))),
    ],
)
def test_each_excitation_declares_a_generator_voltage_or_a_held_base_acceleration(kind, level):
    assert by_kind[kind].level_at(250.0) == level


def test_a_settled_sine_that_holds_no_base_level_plays_a_constant_voltage():
    plain = SettledSine(amplitude_vpp=1, frequencies_hz=(200, 210))
    assert plain.level_at(200.0) == RelativeSetting(1.0)
    assert not list(plain.held_accelerations())


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("sine_sweep", "sine sweep, 1 Vpp"),
        ("held_dwell", "held dwell, base held at 5 µm, at most 1 Vpp"),
        ("held_response", "held response, relative motion of m0 held at 5 µm, at most 1 Vpp"),
        ("held_noise", "held noise, base held at 2.79 m/s² rms, at most 1 Vpp"),
        ("resonance_tracking", "resonance tracking, base held at 0.6 m/s², 0.3 m/s², at most 1 Vpp"),
    ],
)
def test_the_description_of_a_plan_names_its_held_level(kind, said):
    assert excitation_text(by_kind[kind]) == said


@pytest.mark.parametrize(
    "kind", ["sine_sweep", "held_sweep", "stepped_sine", "settled_sine", "held_response"]
)
def test_sweeps_approach_their_frequencies_from_the_requested_side(kind):
    for direction, approach in ((Direction.UP, Approach.UP), (Direction.DOWN, Approach.DOWN)):
        turned = by_kind[kind].turned(direction)
        assert turned.approach is approach
        assert turned.turned(Direction.UP) == by_kind[kind].turned(Direction.UP)


@pytest.mark.parametrize("kind", ["dwell", "held_dwell", "white_noise", "resonance_tracking"])
def test_kinds_of_excitation_without_a_direction_cannot_be_reversed(kind):
    assert by_kind[kind].turned(Direction.UP) is None
    assert by_kind[kind].approach is Approach.REST


def test_level_steps_follow_the_requested_direction():
    falling = by_kind["stepped_level"].turned(Direction.DOWN)
    assert [step.play.level for step in falling.steps()] == [1.0, 0.75, 0.5]


def test_only_a_dwell_can_begin_with_lead_in_tones():
    assert [kind for kind, each in by_kind.items() if each.led(WAY, 0.5) is not None] == ["dwell"]
    led, tone = by_kind["dwell"].led(WAY, 0.25)
    assert (led.lead_in, led.lead_in_s) == (WAY, 0.25)
    assert tone == LeadIn(frequency_hz=260, amplitude_vpp=1)
