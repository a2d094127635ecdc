"""Campaigns on the command line: estimates, catalogue and notifications, as JSON and in sentences."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from vibench.acquisition import open_recording
from vibench.acquisition.campaign import CampaignEstimate
from vibench.cli.measure import estimate_text

from .killed_campaign import short_points, slow_rig

HARDWARE_CONFIGS = Path(__file__).parents[2] / "hardware_configs"


def test_an_estimate_is_one_json_document_and_writes_no_file(output_of, tmp_path):
    plan, bench = short_points(tmp_path, 3), slow_rig(tmp_path)
    told = output_of("measure", plan, "--bench", bench, "--out", "out", "--estimate", "--json")
    assert (told["recordings"], told["kept"], told["fits"]) == (3, 0, True)
    assert abs(told["duration_s"] - 3 * (0.6 + 0.08 + 0.3 + 0.1 + 0.08)) < 1e-6
    assert not (tmp_path / "out").exists()


def test_the_estimate_of_a_sweep_of_noise_levels_states_their_expected_uncertainty(output_of, tmp_path):
    plan, bench = short_points(tmp_path, 1), slow_rig(tmp_path)
    noise = '{ kind = "white_noise", band_start_hz = 50, band_stop_hz = 600, realisations = 2 }'
    text = f'name = "c"\n[[sweeps]]\nname = "noise"\nmeasurement = {{ excitation = {noise} }}\n'
    plan.write_text(text + "amplitude_vpp = [0.05, 0.1]\n", encoding="utf-8")
    told = output_of("measure", plan, "--bench", bench, "--out", "out", "--estimate", "--json")
    assert set(told["uncertainty"]) == {"noise-0p05vpp", "noise-0p1vpp"}
    assert all(told["uncertainty"].values())


def test_an_estimate_refuses_a_level_beyond_the_limits(refusal, tmp_path):
    plan, bench = short_points(tmp_path, 2), slow_rig(tmp_path)
    plan.write_text(plan.read_text(encoding="utf-8").replace("[0.05]", "[0.05, 50]"), encoding="utf-8")
    said = refusal("measure", plan, "--bench", bench, "--out", "out", "--estimate")
    assert "line-50vpp-200hz: the generator voltage would be 50 Vpp, but must be at most 10 Vpp" in said


@pytest.mark.thorough
def test_a_campaign_is_logged_and_catalogued_and_a_notice_is_sent_at_its_end(vibench, tmp_path):
    plan, bench = short_points(tmp_path, 2), slow_rig(tmp_path)
    keep = f"{sys.executable} -c \"import sys; open('told.json', 'w').write(sys.stdin.read())\""
    measure = ("measure", plan, "--bench", bench, "--out", "out", "--notify", keep)
    made = vibench("--log-level", "debug", *measure, cwd=tmp_path)
    assert made.returncode == 0, made.stderr
    assert "vibench.acquisition: " in made.stderr
    assert "*IDN?" in made.stderr
    assert "line-0p05vpp-200hz.h5, sample 5018: state: recording" in made.stderr
    told = json.loads((tmp_path / "told.json").read_text())
    assert (told["event"], told["why"], told["recorded"]) == ("ended", "carried_out", 2)
    listed = vibench("catalogue", "out", "--json", cwd=tmp_path)
    entries = json.loads(listed.stdout)["recordings"]
    assert [entry["path"] for entry in entries] == ["line-0p05vpp-200hz.h5", "line-0p05vpp-201hz.h5"]
    assert {entry["verdict"] for entry in entries} == {"samples not checked"}


@pytest.mark.thorough
def test_a_campaign_accepts_only_a_knob_sheet_with_its_own_settings(output_of, vibench_here, tmp_path):
    plan, bench = short_points(tmp_path, 2), slow_rig(tmp_path)
    knobs, campaign = tmp_path / "knobs.toml", ("measure", plan, "--bench", bench, "--knobs", "knobs.toml")
    output_of("bench", "check", "--bench", bench, "--knobs", knobs)
    knobs.write_text(knobs.read_text().replace('"simulated"', '"A. Student"'))
    output_of(*campaign, "--out", "out")
    with open_recording(next(tmp_path.glob("out/*.h5"))) as recording:
        assert recording.confirmations["operator"] == "A. Student"
    knobs.write_text(knobs.read_text().replace('"10 dB"', '"20 dB"'))
    refused = vibench_here(*campaign, "--out", "elsewhere", cwd=tmp_path)
    assert refused.returncode == 1
    assert "does not confirm Bruel & Kjaer 2706 gain at 10 dB" in refused.stderr
    assert not list(tmp_path.glob("elsewhere/*.h5*"))


@pytest.mark.thorough
def test_a_knob_sheet_does_not_overwrite_another_kind_of_file(vibench_here, tmp_path):
    plan, bench = short_points(tmp_path, 2), slow_rig(tmp_path)
    before = plan.read_text()
    refused = vibench_here("bench", "check", "--bench", bench, "--knobs", plan, cwd=tmp_path)
    assert refused.returncode == 1
    assert plan.read_text() == before


def test_an_estimate_in_words_states_the_lead_in_times_and_that_the_disk_is_too_small():
    times = {"duration_s": 3723.4, "rest_s": 120.0, "lead_in_s": 60.0}
    sizes = {"largest_bytes": 10**6, "total_bytes": 2 * 10**6, "free_bytes": 10**6}
    expected = CampaignEstimate(recordings=3, kept=2, **times, **sizes)
    first, rest, second, third = estimate_text(expected).splitlines()
    assert first == "3 recordings (2 kept), 1:02:03 (h:min:s) of rig time, about 2 MB; 1 MB are free"
    assert rest == "Silence between recordings: 0:02:00 (included)"
    assert second == "Lead-ins to points of chains: 0:01:00 (included)"
    assert third.startswith("The disk may be full before the end")
    # A feedback measurement ends when its result is found.
    searching = estimate_text(replace(expected, searching=1))
    assert searching.startswith("3 recordings (2 kept), at most 1:02:03 (h:min:s) of rig time")


@pytest.mark.thorough
def test_an_estimate_refuses_a_branch_that_the_fast_loop_cannot_hold(refusal, tmp_path):
    pytest.importorskip("vibench_fast_loop", reason="pip install -e extensions/fast_loop brings it")
    usual = (HARDWARE_CONFIGS / "virtual_rig_controller.toml").read_text(encoding="utf-8")
    bench = tmp_path / "late.toml"
    bench.write_text(usual.replace("latency_s = 3e-4", "latency_s = 2e-3"), encoding="utf-8")
    said = refusal("measure", "branch", "--bench", bench, "--out", "out", "--estimate")
    assert "largest multiplier is 1.21 at 116.2" in said
    assert not (tmp_path / "out").exists()


def test_an_estimate_reports_a_missing_real_time_controller_of_the_bench(refusal, tmp_path):
    pytest.importorskip("vibench_fast_loop", reason="pip install -e extensions/fast_loop brings it")
    said = refusal("measure", "branch", "--bench", "virtual_rig", "--out", "out", "--estimate")
    assert "branch_3um needs a real-time controller, but this bench has none" in said
    assert not (tmp_path / "out").exists()
