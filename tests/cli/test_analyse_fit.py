"""`vibench analyse --fit`: the identified specimen with intervals, as JSON and in words."""

import json

import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition.plan import WhiteNoise
from vibench.sim import base_transmissibility, gong2025, load_specimen

DAMPING_S = 3.3e-5
NOISE = {"band_start_hz": 60.0, "band_stop_hz": 560.0, "repetition_hz": 4.0, "periods": 2}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with a recording of weak noise, of a specimen with more damping than configured."""
    place, rng = tmp_path_factory.mktemp("fit"), np.random.default_rng(4)
    lines = np.arange(NOISE["band_start_hz"], NOISE["band_stop_hz"] + 1, NOISE["repetition_hz"])
    motions = [synthetic.multisine(2.5, lines, 1e-9, number) for number in range(2)]
    velocities = [synthetic.response_of(each, specimen=gong2025(DAMPING_S))[0] for each in motions]
    base = synthetic.Motion(
        np.concatenate([each.displacement_m for each in motions]),
        np.concatenate([each.acceleration for each in motions]),
    )
    velocity = np.concatenate(velocities)
    parts = [
        synthetic.Part("realisation", 3.0 * number + 2.0, 3.0 * number + 2.5, {"realisation": number})
        for number in range(2)
    ]
    plan = WhiteNoise(amplitude_vpp=0.05, realisations=2, settle_s=2.0, **NOISE)
    noisy = velocity + 2e-7 * rng.standard_normal(velocity.size)
    synthetic.write_recording(place, plan, base, noisy, parts, name="noise")
    return place


@pytest.mark.thorough
def test_the_json_output_contains_fit_intervals_and_undetermined_parameters(vibench_here, folder):
    result = vibench_here("analyse", folder, "--fit", "--no-simulate", "--json", cwd=folder)
    assert result.returncode == 0, result.stderr
    fit = json.loads(result.stdout)["specimen_fit"]
    damping = fit["values"]["damping_time_s"]
    assert damping["value"] == pytest.approx(DAMPING_S, rel=0.03)
    assert damping["low"] < damping["value"] < damping["high"] < 2 * damping["bench"]
    assert damping["bench"] == pytest.approx(2e-5)
    assert "gap_m" not in fit["values"]
    assert any("gap stays as described" in each for each in fit["not_told"])


@pytest.mark.thorough
def test_a_fit_is_printed_in_words_and_saved_as_a_specimen_file(vibench_here, folder, tmp_path):
    result = vibench_here(
        "analyse", folder, "--fit", "--no-simulate", "--out", tmp_path / "report", cwd=folder
    )
    assert result.returncode == 0, result.stderr
    assert "Fitted c / k = 3" in result.stdout
    assert "described: 20.0" in result.stdout
    written = tmp_path / "report" / "specimen.toml"
    # A narrow terminal may break the path anywhere.
    assert str(written) in result.stdout.replace("\n", "")
    fitted = load_specimen(written).specimen()
    assert fitted.dampings[0] / fitted.stiffnesses[0] == pytest.approx(DAMPING_S, rel=0.03)
    assert fitted.masses == gong2025().masses
    predicted = vibench_here(
        *("predict", "--specimen", written, "--amplitude", "1e-7", "--frequency", "130", "--json"), cwd=folder
    )
    assert predicted.returncode == 0, predicted.stderr
    (point,) = json.loads(predicted.stdout)["points"]
    assert point["response_i"] == pytest.approx(abs(base_transmissibility(fitted, 130.0)[0, 0]), rel=1e-6)


LEVELS = """
name = "levels"
[defaults]
ramp_s = 0.3
[[measurements]]
name = "noise"
[measurements.excitation]
kind = "white_noise"
amplitude_vpp = {}
band_start_hz = 20
band_stop_hz = 800
realisations = 2
settle_s = 1.5
"""


@pytest.mark.thorough
def test_a_fit_to_noise_with_collisions_is_refused(vibench_here, tmp_path):
    (tmp_path / "levels.toml").write_text(LEVELS.format(0.3))
    measured = vibench_here("measure", "levels.toml", "--out", "levels", "--check", "waived", cwd=tmp_path)
    assert measured.returncode == 0, measured.stderr
    result = vibench_here("analyse", "levels", "--fit", "--no-simulate", "--out", "report", cwd=tmp_path)
    said = " ".join(result.stdout.split())
    assert result.returncode == 0, result.stderr
    assert "Fitted" not in said
    assert "No value is fitted to noise: the linear response leaves" in said
    assert "so masses may collide or rub; measure with weaker noise." in said
    assert not (tmp_path / "report" / "specimen.toml").exists()
    as_json = vibench_here("analyse", "levels", "--fit", "--no-simulate", "--json", cwd=tmp_path)
    fit = json.loads(as_json.stdout)["specimen_fit"]
    assert (fit["fits"], fit["values"]) == (False, {})
    assert fit["suspects"][0]["assumption"] == "linearity"


DWELL = """
[[measurements]]
name = "dwell"
excitation = { kind = "dwell", amplitude_vpp = 1.5, frequency_hz = 260, settle_s = 1, duration_s = 2 }
"""


@pytest.mark.thorough
def test_noise_with_collisions_does_not_prevent_the_fit_of_gaps_to_a_dwell(vibench_here, tmp_path):
    """At 1 Vpp the motion is chaotic: realisations scatter no more than periods do."""
    (tmp_path / "levels.toml").write_text(LEVELS.format(1.0) + DWELL)
    vibench_here("measure", "levels.toml", "--out", "levels", "--check", "waived", cwd=tmp_path)
    as_json = vibench_here("analyse", "levels", "--fit", "--no-simulate", "--json", cwd=tmp_path)
    fit = json.loads(as_json.stdout)["specimen_fit"]
    assert (fit["fits"], fit["values"], fit["tracked_from"]) == (False, {}, "dwell")
    for gap in ("lower_gap_m", "upper_gap_m"):
        assert fit["tracked"][gap]["low"] < 45e-6 < fit["tracked"][gap]["high"]
