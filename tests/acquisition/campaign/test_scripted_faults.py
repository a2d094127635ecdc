"""A campaign on a rig with scripted faults repeats measurements and loses no point."""

import json
from pathlib import Path

import pytest

from vibench.acquisition import open_recording, run_campaign
from vibench.acquisition.campaign import AfterFailure, PointOutcome, ReconnectingBench
from vibench.acquisition.plan import Campaign, Dwell, Measurement, Retryable, RetryPolicy
from vibench.acquisition.recording import RecordingState
from vibench.acquisition.rig import with_faults

SCRIPT = [
    {"at_s": 1.9, "fault": "pull_usb_cable", "for_s": 1.5},
    {"at_s": 9.0, "fault": "overrun", "for_s": 0.4},
    {"at_s": 14.0, "fault": "lose_daq_server", "for_s": 1.5},
    {"at_s": 19.0, "fault": "turn_amplifier_gain", "gain_db": 20, "for_s": 2.0},
]


@pytest.mark.thorough
def test_a_campaign_records_every_point_despite_scripted_faults(rig, tmp_path):
    lines = [
        ["[[faults]]", *(f"{key} = {json.dumps(value)}" for key, value in each.items())] for each in SCRIPT
    ]
    script = tmp_path / "faults.toml"
    script.write_text("\n".join(line for each in lines for line in each), encoding="utf-8")
    dwell = Dwell(amplitude_vpp=0.5, frequency_hz=260, settle_s=0.1, duration_s=1)
    campaign = Campaign(
        name="night",
        measurements=tuple(
            Measurement(name=f"point{number}", excitation=dwell, ramp_s=0.3, ramp_step_s=0.03)
            for number in range(6)
        ),
        retry=RetryPolicy(attempts=4, on=(*RetryPolicy().on, Retryable.CHECK_FAILED, Retryable.LIMIT)),
    )
    with ReconnectingBench(with_faults(rig, script)) as kept:
        point_results = run_campaign(
            kept.bench, campaign, tmp_path / "out", after_failure=AfterFailure.GO_ON, reopen=kept.reopen
        )
        assert [each.fault for each in kept._power.played_faults] == [each["fault"] for each in SCRIPT]
    assert [(point_result.name, point_result.outcome) for point_result in point_results] == [
        (f"point{number}", PointOutcome.RECORDED) for number in range(6)
    ]
    said = " ".join(reason_of(path) for path in sorted((tmp_path / "out").glob("*.h5")))
    for cause in ("InstrumentLost", "overwritten", "the base acceleration is"):
        assert cause in said


def reason_of(path: Path) -> str:
    with open_recording(path) as recording:
        assert recording.state in (RecordingState.COMPLETE, RecordingState.FAILED)
        return recording.reason
