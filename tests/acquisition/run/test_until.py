"""Recordings that last until their targets are met, on the virtual rig with analysis during the run."""

import pytest

from tests.changed import changed
from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import (
    Dwell,
    Measurement,
    RunState,
    SteppedSine,
    StreamedNoise,
    Until,
    WhiteNoise,
)
from vibench.acquisition.recording import UntilNote, feedback_note
from vibench.acquisition.rig import load_rig
from vibench.acquisition.run.until import UntilWatch
from vibench.acquisition.stopping.stop import Cause, StopRequest, StopSwitch
from vibench.analysis import analyse


@pytest.fixture
def rig():
    """Return the virtual rig in real time, so that the analysis keeps up with the run."""
    rig = load_rig("virtual_rig")
    return changed(rig, virtual={"pace": "wall", "speed": 1.0})


def record(rig, folder, excitation, until, **more):
    plan = Measurement(name="run", excitation=excitation, ramp_s=0.4, ramp_step_s=0.02, until=until)
    seen = []
    with open_bench(rig) as bench:
        outcome = run_measurement(bench, plan, folder / "run.h5", on_progress=seen.append, **more)
    return outcome, open_recording(outcome.path), [each.until for each in seen if each.until is not None]


def notes(recording):
    found = (feedback_note(each) for each in recording.events)
    return [each for each in found if each is not None and each.kind == "until"]


def seconds(recording, label):
    return [
        (each.stop - each.start) / recording.sample_rate_hz
        for each in recording.segments
        if each.label == label
    ]


@pytest.mark.thorough
def test_a_dwell_ends_when_the_error_of_its_response_is_small_enough(rig, tmp_path):
    dwell = Dwell(amplitude_vpp=0.1, frequency_hz=200, settle_s=0.5, duration_s=120)
    outcome, recording, seen = record(rig, tmp_path, dwell, Until(response_ii=0.01))
    with recording:
        (note,), (recorded_s,) = notes(recording), seconds(recording, "dwell")
        assert recording.reason == outcome.reason
        parts = next(each for each in analyse(recording).checks if each.what == "Parts")
    assert outcome.state is RunState.FINISHED
    assert "known well enough" in outcome.reason
    assert note.is_reached
    assert note.bounds["response_ii"] < 0.01
    assert recorded_s == pytest.approx(note.recorded_s)
    assert 2.0 <= recorded_s < 100
    assert "reached" in seen[-1].sentence
    assert parts.verdict.value == "passed"


@pytest.mark.thorough
@pytest.mark.parametrize("shortest_s", [0.5, 5e-324])
def test_a_dwell_that_does_not_reach_its_bound_ends_after_its_longest_time(rig, tmp_path, shortest_s):
    dwell = Dwell(amplitude_vpp=0.1, frequency_hz=200, settle_s=0.5, duration_s=3)
    outcome, recording, _ = record(rig, tmp_path, dwell, Until(response_ii=1e-9, shortest_s=shortest_s))
    with recording:
        (note,) = notes(recording)
        assert seconds(recording, "dwell") == [pytest.approx(3.0)]
    assert outcome.state is RunState.FINISHED
    assert not note.is_reached
    assert "longest time after 3 s" in outcome.reason


@pytest.mark.thorough
def test_each_frequency_step_ends_when_its_bound_is_met(rig, tmp_path):
    steps = SteppedSine(amplitude_vpp=0.1, frequencies_hz=(150, 160), settle_s=0.3, record_s=60)
    _, recording, _ = record(rig, tmp_path, steps, Until(response_ii=0.02, shortest_s=1.0))
    with recording:
        found = notes(recording)
        assert seconds(recording, "step") == [pytest.approx(each.recorded_s) for each in found]
    assert [each.stretch for each in found] == [1, 2]
    assert all(each.is_reached and each.recorded_s < 60 for each in found)


@pytest.mark.thorough
def test_noise_with_the_key_until_ends_with_a_whole_realisation_and_a_ramp_down(rig, tmp_path):
    noise = WhiteNoise(
        amplitude_vpp=0.05, band_start_hz=20, band_stop_hz=800, repetition_hz=2, settle_s=0.5, realisations=40
    )
    wish = Until(resonance_hz=0.01, transmissibility=0.2)
    _, recording, _ = record(rig, tmp_path, noise, wish)
    with recording:
        (note,) = notes(recording)
        recorded, labels = seconds(recording, "realisation"), [each.label for each in recording.segments]
    assert note.is_reached
    assert set(note.bounds) == {"resonance_hz", "transmissibility"}
    assert 4 <= len(recorded) < 40
    assert recorded == [pytest.approx(1.0)] * len(recorded)
    # The bound may be met while the next realisation is already ramping up.
    assert labels[-1] == "ramp_down"
    assert note.recorded_s == pytest.approx(len(recorded))


@pytest.mark.thorough
def test_a_stream_with_buffered_samples_ends_when_its_bound_is_met(tmp_path):
    rig = load_rig("virtual_rig_streaming")
    output = rig.daq.output.model_copy(update={"ahead_s": 2.0})
    rig = changed(rig, virtual={"pace": "wall", "speed": 1.0}, daq={"output": output})
    noise = StreamedNoise(amplitude_vpp=0.1, band_start_hz=50, band_stop_hz=600, duration_s=120, settle_s=0.5)
    outcome, recording, _ = record(rig, tmp_path, noise, Until(resonance_hz=0.05, shortest_s=5.0))
    with recording:
        (note,), (recorded_s,) = notes(recording), seconds(recording, "noise")
        assert recording.segments[-1].label == "ramp_down"
    assert outcome.state is RunState.FINISHED
    assert note.is_reached
    assert 5 <= recorded_s < 110


@pytest.mark.thorough
def test_a_stop_ends_a_recording_with_the_key_until(rig, tmp_path):
    switch = StopSwitch()
    plan = Measurement(
        name="run",
        excitation=Dwell(amplitude_vpp=0.1, frequency_hz=200, settle_s=0.5, duration_s=60),
        until=Until(response_ii=1e-9, shortest_s=0.5),
        ramp_s=0.4,
    )

    def stop_after_two_seconds(progress):
        if progress.elapsed_s > 2:
            switch.ask(StopRequest.of(Cause.OPERATOR, "enough"))

    with open_bench(rig) as bench:
        outcome = run_measurement(
            bench, plan, tmp_path / "run.h5", on_progress=stop_after_two_seconds, switch=switch
        )
    assert (outcome.state, outcome.reason) == (RunState.STOPPED, "enough")


@pytest.mark.thorough
def test_the_recording_continues_if_the_analysis_process_dies(rig, tmp_path, monkeypatch):
    began = UntilWatch.wait_until_ready

    def kill_when_ready(watch, switch):
        began(watch, switch)
        watch._process.kill()
        watch._process.wait()

    monkeypatch.setattr(UntilWatch, "wait_until_ready", kill_when_ready)
    dwell = Dwell(amplitude_vpp=0.1, frequency_hz=200, settle_s=0.5, duration_s=2)
    outcome, recording, _ = record(rig, tmp_path, dwell, Until(response_ii=0.01, shortest_s=0.5))
    with recording:
        assert seconds(recording, "dwell") == [pytest.approx(2.0)]
    assert outcome.state is RunState.FINISHED
    assert "the analysis during the run has ended" in outcome.reason


@pytest.mark.parametrize(
    ("bounds", "said"),
    [
        ({}, "not known (goal: 1 %)"),
        ({"response_i": None}, "not known (goal: 1 %)"),
        ({"response_i": 0.02}, "about 12 s left"),
        ({"response_i": 0.5}, "not within 20 s"),
    ],
)
def test_the_remaining_time_is_estimated_with_a_bound_proportional_to_1_over_sqrt_time(bounds, said):
    progress = UntilNote(stretch=1, wishes={"response_i": 0.01}, bounds=bounds, looked_s=4.0, longest_s=20.0)
    assert said in progress.sentence
