"""Rigs with other sensors on m0, sensors on other masses, and a force cell."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest
from pydantic import ValidationError

from vibench.acquisition import open_bench, open_recording, run_campaign
from vibench.acquisition.bench import InstrumentList, Verdict
from vibench.acquisition.check.bench_report import bench_report
from vibench.acquisition.errors import ConfigurationError
from vibench.acquisition.first_day import configure, questions_for
from vibench.acquisition.host.installation import shipped
from vibench.acquisition.plan import Campaign, Measurement
from vibench.acquisition.plan._limits import limit_checks
from vibench.acquisition.rig import Rig, load_rig, specimen_of
from vibench.analysis import Simulation, analyse, analyse_files, budget_sentences, budgets_of, other_responses
from vibench.analysis.errors import UnusableData
from vibench.analysis.recordings.channels import derivative_kernel
from vibench.analysis.report import write_report
from vibench.sim import base_transmissibility

BASE, WITHOUT = load_rig("virtual_rig"), load_rig("virtual_rig_accelerometers")
SHEETS = {
    "acceleration": {"sensitivity": "10 mV/g", "resonance_hz": 50e3},
    "velocity": {"sensitivity": "250 mm/s/V"},
    "displacement": {"sensitivity": "20 mV/um", "bandwidth_hz": 50e3, "delay_s": 5e-6},
    "force": {"sensitivity": "22 mV/N"},
}
NOISE = {"acceleration": 3e-5, "displacement": 1e-12, "force": 2e-6}
DWELL = {"kind": "dwell", "settle_s": 1.0, "duration_s": 1.5}


def sensor_table(role, **more):
    quantity = role.partition("_")[2]
    noise = {"value": NOISE.get(quantity, 1e-9), "source": "test"}
    usual = {"model": role, "full_scale_v": 5.0, "calibrated": "2026-02-10", "noise_per_rthz": noise}
    return {**usual, **SHEETS[quantity], **more}


def rig_with(*roles, without=("amplifier_voltage",), **more):
    """Return the virtual rig with further sensors at the inputs of omitted channels."""
    said = BASE.model_dump(mode="json")
    kept = [each for each in said["daq"]["channels"] if each["role"] not in without]
    free = sorted({f"ai{number}" for number in range(4)} - {each["physical"] for each in kept})
    usual = {"range_v": 5.0, "coupling": "DC", "calibrated": "2026-02-10"}
    kept += [{"role": role, "physical": at, **usual} for role, at in zip(roles, free, strict=False)]
    said["daq"]["channels"] = kept
    said["sensors"] = {role: sensor_table(role, **more) for role in roles}
    if "m0_velocity" in without:
        said["vibrometer"] = None
    return Rig.model_validate(said)


ON_M0 = pytest.mark.parametrize("role", ["m0_acceleration", "m0_displacement"])


def record(rig, folder, **excitation):
    plan = {
        "name": "s",
        "defaults": {"ramp_s": 0.2},
        "measurements": [{"name": "s", "excitation": excitation}],
    }
    with open_bench(rig) as bench:
        (result,) = run_campaign(bench, Campaign.model_validate(plan), folder)
    return result.path


def amplitude(samples, rate_hz, frequency_hz):
    turns = np.exp(-2j * np.pi * frequency_hz / rate_hz * np.arange(samples.size))
    taper = np.hanning(samples.size)
    return 2 * np.sum(samples * taper * turns) / taper.sum()


@pytest.mark.thorough
@pytest.mark.parametrize("role", ["m0_displacement", "m0_acceleration"])
def test_a_probe_and_an_accelerometer_measure_the_same_motion_as_the_vibrometer(tmp_path, role):
    path = record(rig_with(role), tmp_path, amplitude_vpp=0.5, frequency_hz=250.0, **DWELL)
    with open_recording(path) as recording:
        rate = recording.sample_rate_hz
        chosen = slice(round(0.5 * rate), None)
        velocity, other = (recording.read(each)[chosen] for each in ("m0_velocity", role))
        header = recording.channel(role)
    assert header.quantity == role.partition("_")[2]
    lower = "m0_displacement" in role
    given, wanted = (other, velocity) if lower else (velocity, other)
    found = np.convolve(given, derivative_kernel(rate), "valid")
    wanted = wanted[64:-64]
    at = amplitude(found, rate, 250.0) / amplitude(wanted, rate, 250.0)
    assert abs(at) == pytest.approx(1.0, rel=3e-4)


@pytest.mark.thorough
@ON_M0
def test_the_bench_check_verifies_the_sign_of_a_sensor_on_m0(tmp_path, role):
    with open_bench(rig_with(role, without=("m0_velocity",))) as bench:
        report = bench_report(bench, tmp_path)
    found = {each.name: each.verdict for each in report.findings}
    assert found[f"{role} detects the sine"] is Verdict.OK
    assert found[f"sign of {role}"] is Verdict.OK
    assert report.verdict is not Verdict.FAIL


@ON_M0
def test_a_plan_beyond_the_range_of_a_sensor_on_m0_is_refused(role):
    plan = {
        "name": "s",
        "excitation": {"kind": "dwell", **DWELL, "amplitude_vpp": 1.0, "frequency_hz": 260.0},
    }
    rig = rig_with(role, without=("m0_velocity",), full_scale_v=1e-3)
    (check,) = (
        each
        for each in limit_checks(Measurement.model_validate(plan), rig)
        if each.what.startswith(f"the {role.partition('_')[2]} of m0")
    )
    assert not check.is_kept


@pytest.fixture(scope="module")
def by_laser_and_accelerometer(tmp_path_factory):
    """The paper's campaign, shortened: noise, sweep and chaotic dwell, with either sensor on m0."""
    noise = {"band_start_hz": 60, "band_stop_hz": 560, "repetition_hz": 2, "realisations": 3, "periods": 2}
    plans = {
        "noise": {"kind": "white_noise", "amplitude_vpp": 0.05, "settle_s": 2.0, **noise},
        "sweep": {
            "kind": "sine_sweep", "amplitude_vpp": 0.3, "start_hz": 230, "stop_hz": 250, "duration_s": 4.0,
        },
        "dwell": {**DWELL, "amplitude_vpp": 1.5, "frequency_hz": 260.0, "duration_s": 3.0},
    }  # fmt: skip
    both = []
    for rig in (BASE, WITHOUT):
        folder = tmp_path_factory.mktemp("sensors")
        paths = [record(rig, folder / name, **plan) for name, plan in plans.items()]
        both.append(analyse_files(paths, "both", Simulation.LEFT_OUT))
        assert not both[-1].failures
    return both


@pytest.mark.thorough
def test_a_dwell_without_a_vibrometer_gives_responses_from_accelerometers(
    by_laser_and_accelerometer, tmp_path
):
    by_laser, by_accelerometer = (done.results[-1].analysis for done in by_laser_and_accelerometer)
    assert by_accelerometer.facts.response == "m0_acceleration"
    assert by_accelerometer.response.response_i == pytest.approx(by_laser.response.response_i, rel=5e-3)
    assert by_accelerometer.response.response_ii == pytest.approx(by_laser.response.response_ii, rel=1e-3)
    said = " ".join(budget_sentences(by_laser_and_accelerometer[1]))
    assert "accelerometer calibration" in said
    assert "vibrometer" not in said
    report = write_report(by_laser_and_accelerometer[1], tmp_path / "report.html")
    assert "IEPE accelerometer 10 mV/g" in report.read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"vibrometer": None}, "the channel m0_velocity has no sensor; add the table [vibrometer]"),
        ({"sensors": {"m2_velocity": sensor_table("m0_acceleration")}}, "is not a sensitivity for 'm s-1'"),
        ({"sensors": {"drive_voltage": sensor_table("m0_force")}}, "a voltage channel has no sensor"),
        (
            {"sensors": {"m0_velocity": sensor_table("m0_velocity")}},
            "describe this sensor in the table [vibrometer]",
        ),
        ({"sensors": {"m9_velocity": sensor_table("m0_velocity")}}, "m9_velocity"),
    ],
)
def test_an_unsuitable_sensor_is_refused(change, words):
    with pytest.raises(ValidationError, match=re.escape(words)):
        Rig.model_validate({**BASE.model_dump(mode="json"), **change})


def test_the_error_for_a_missing_sensor_names_the_table_to_add():
    said = WITHOUT.model_dump(mode="json") | {"sensors": {}}
    with pytest.raises(ValidationError, match=re.escape("[sensors.m0_acceleration] (docs/sensor-units.md)")):
        Rig.model_validate(said)


def test_the_first_day_procedure_covers_all_sensors_of_the_template(tmp_path):
    template = shipped("hardware_configs/virtual_rig_accelerometers.toml")
    keys = {each.key for each in questions_for(template.read_text())}
    assert "vibrometer.serial" not in keys
    assert {"sensors.m0_acceleration.sensitivity", "daq.channels.base_force.physical"} <= keys
    given = {"sensors.m0_acceleration.sensitivity": "9.8 mV/g", "sensors.base_force.serial": "4711"}
    rig = configure(
        template,
        tmp_path / "own.toml",
        InstrumentList((), (), ()),
        lambda question, *_: given.get(question.key, ""),
        "note",
    )
    assert rig.sensors["m0_acceleration"].sensitivity == "9.8 mV/g"
    assert rig.sensors["base_force"].serial == "4711"


def test_feedback_without_a_sensor_on_m0_is_refused_before_output(tmp_path):
    level = {"displacement_m": 1e-6}
    rig = rig_with("m2_acceleration", without=("m0_velocity",))
    with pytest.raises(ConfigurationError, match=r"needs the channel m0_velocity.*Nothing was played"):
        record(
            rig, tmp_path, kind="held_dwell", frequency_hz=200.0, amplitude_vpp=0.5,
            base_level=level, duration_s=1.0,
        )  # fmt: skip


@pytest.mark.thorough
def test_a_sensor_on_m2_is_analysed_and_reported(tmp_path):
    noise = {"band_start_hz": 60, "band_stop_hz": 560, "repetition_hz": 2, "realisations": 3, "periods": 2}
    path = record(
        rig_with("m2_acceleration"), tmp_path, kind="white_noise", amplitude_vpp=0.05, settle_s=2.0, **noise
    )
    assert other_responses([path]) == {"m2_acceleration": (path,)}
    of_m2, of_m0 = (analyse(path, response=role) for role in ("m2_acceleration", None))
    assert (of_m2.facts.mass, of_m0.facts.mass) == ("m2", "m0")
    for found, column in ((of_m2, 2), (of_m0, 0)):
        response = found.response.frequency_response
        model = base_transmissibility(specimen_of(BASE), response.frequency_hz)[:, column]
        at = [int(np.argmin(np.abs(response.frequency_hz - hz))) for hz in (94.5, 266.0, 500.0)]
        np.testing.assert_allclose(np.abs(response.value)[at], np.abs(model)[at], rtol=0.03)
    command = [sys.executable, "-m", "vibench.cli", "analyse", path, "--no-simulate", "--json"]
    ended = subprocess.run(
        [*command, "--out", tmp_path / "out"], capture_output=True, text=True, check=True, timeout=110
    )
    said = json.loads(ended.stdout)
    assert said["responses"]["m2_acceleration"]["results"][0]["recording"]["name"] == "s"
    report = (tmp_path / "out" / "report_m2_acceleration.html").read_text(encoding="utf-8")
    assert list((tmp_path / "out" / "figures_m2_acceleration").glob("transmission_s.*"))
    shown = re.sub(r"<(script|style).*?</\1>|data:[^\"]+", "", report, flags=re.DOTALL)
    # m0 appears in the list of channel levels only.
    assert re.findall(r".{30}\bm0\b(?! velocity).{20}", shown) == []


@pytest.mark.thorough
def test_a_campaign_with_accelerometers_matches_the_vibrometer(by_laser_and_accelerometer):
    budgets = [
        [each for result in done.results for each in budgets_of(result)]
        for done in by_laser_and_accelerometer
    ]
    kinds = [
        [
            motion and motion.verdict.kind
            for motion in (getattr(each.analysis, "motion", None) for each in done.results)
        ]
        for done in by_laser_and_accelerometer
    ]
    compared = 0
    for one, other in zip(*budgets, strict=True):
        assert re.sub(r"[\d.]+ Hz", "", one.quantity) == re.sub(r"[\d.]+ Hz", "", other.quantity)
        if np.isfinite(one.expanded) and np.isfinite(other.expanded):
            compared += 1
            assert abs(one.value - other.value) <= np.hypot(one.expanded, other.expanded), one.quantity
    assert compared >= 13
    assert kinds[0] == kinds[1]


@pytest.mark.thorough
def test_an_analysis_of_a_force_response_to_a_sine_is_refused(tmp_path):
    path = record(rig_with("base_force"), tmp_path, amplitude_vpp=0.05, frequency_hz=80.0, **DWELL)
    assert other_responses([path]) == {}
    with pytest.raises(UnusableData, match="base_force has results only for noise"):
        analyse(path, response="base_force")
    with pytest.raises(UnusableData, match="drive_voltage measures neither a force nor the motion"):
        analyse(path, response="drive_voltage")


@pytest.mark.thorough
def test_a_force_cell_gives_the_apparent_mass_in_kilograms(tmp_path):
    noise = {"band_start_hz": 60, "band_stop_hz": 560, "repetition_hz": 2, "realisations": 3, "periods": 2}
    path = record(
        rig_with("base_force"), tmp_path, kind="white_noise", amplitude_vpp=0.05, settle_s=2.0, **noise
    )
    command = [sys.executable, "-m", "vibench.cli", "analyse", path, "--no-simulate", "--json"]
    ended = subprocess.run(
        [*command, "--out", tmp_path / "out"], capture_output=True, text=True, check=True, timeout=110
    )
    (said,) = json.loads(ended.stdout)["responses"]["base_force"]["results"]
    shown, specimen = said["measured"]["transmission"], specimen_of(BASE)
    assert (shown["quantity"], shown["unit"]) == ("force/acceleration", "kg")
    frequency_hz, found = np.array(shown["frequency_hz"]), np.array(shown["magnitude"])
    s = 2j * np.pi * frequency_hz
    pull = specimen.stiffnesses[0] + s * specimen.dampings[0]
    moved = base_transmissibility(specimen, frequency_hz)[:, 0] - 1
    model = np.abs(BASE.shaker.fixture_mass_kg - pull * moved / s**2)
    assert np.median(np.abs(found / model - 1)) < 5e-3
    held = (np.array(shown["magnitude_lower"]) <= model) & (model <= np.array(shown["magnitude_upper"]))
    assert np.mean(held) > 0.85
    assert [each["frequency_hz"] for each in said["measured"]["resonances"]] == pytest.approx(
        [94.4, 266.0, 500.5], rel=5e-3
    )
    units = {each["quantity"].split(" at ")[0]: each["unit"] for each in said["uncertainty"]}
    assert units["apparent mass"] == "kg"
    report = (tmp_path / "out" / "report_base_force.html").read_text(encoding="utf-8")
    assert "Apparent mass, 0.05 Vpp noise" in report
    assert "x / U" not in re.sub(r"<(script|style).*?</\1>|data:[^\"]+", "", report, flags=re.DOTALL)


@pytest.mark.thorough
def test_feedback_tracks_the_resonance_with_an_accelerometer(tmp_path):
    """The resonance frequency is compared with the closed form."""
    rig = rig_with("m0_acceleration", without=("m0_velocity",))
    plan = {
        "kind": "resonance_tracking", "amplitude_vpp": 0.1, "start_hz": 94.0, "low_hz": 90.0, "high_hz": 99.0,
        "accelerations_m_per_s2": [0.05], "flank_pairs": 0,
    }  # fmt: skip
    with open_recording(record(rig, tmp_path, **plan)) as recording:
        (note,) = [json.loads(each.text) for each in recording.events if each.kind == "resonance"]
    at_hz = np.arange(90.0, 99.0, 0.001)
    ratio = base_transmissibility(specimen_of(rig), at_hz)[:, 0]
    true_hz = at_hz[np.argmin(np.abs(np.angle(ratio - 1) + np.pi / 2))]
    assert note["lock"] == "locked"
    assert abs(note["frequency_hz"] - true_hz) < max(3 * note["frequency_u_hz"], 0.02)
