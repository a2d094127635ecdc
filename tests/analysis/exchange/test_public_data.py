"""Results from public recordings, imported with the shipped mappings, match the published values.

The files are not shipped. docs/exchange.md ("Public recordings") describes them. To fetch and compare them:

    get() { git clone -q https://github.com/$1 ${1#*/}; git -C ${1#*/} show $2:$3 > public/${3##*/}; }
    mkdir public
    get leekunhwee/Vibration-Signal-Processing d9edffe5 ./ImpactTesting/Point1_Channel1_CH1.txt
    get biaslab/nsi-silverbox 728f07e4 ./data/Silverbox/SNLS80mV.mat
    get OWI-Lab/sdypy_io_tdms ab81c619 ./tests/static/good/good_tdms_1.tdms
    get ladisk/pyuff 44a12caa ./data/MPSTD#Set001_2024_10_08_10_27_07.uff
    VIBENCH_PUBLIC_DATA=public pytest tests/analysis/exchange/test_public_data.py
    vibench import public/Point1_Channel1_CH1.txt --mapping examples/mappings/tool_hammer.toml --out tool.h5
    vibench analyse tool.h5 --no-simulate --segment 0.25 --window boxcar
"""

import os
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from vibench.acquisition import load_toml, open_recording
from vibench.analysis import FrequencyResponseRequest, analyse
from vibench.analysis.exchange import ImportMapping, import_recording
from vibench.analysis.frequency_response.results import Window

MAPPINGS = Path(__file__).parents[3] / "examples" / "mappings"
FILES = {
    "tool_hammer": "Point1_Channel1_CH1.txt",
    "silverbox_low": "SNLS80mV.mat",
    "silverbox_high": "SNLS80mV.mat",
    "tower_tdms": "good_tdms_1.tdms",
    "four_points_uff": "MPSTD#Set001_2024_10_08_10_27_07.uff",
}

REQUESTS = {"tool_hammer": FrequencyResponseRequest(segment_s=0.25, window=Window.BOXCAR)}


@pytest.fixture(scope="session")
def imported_path(tmp_path_factory):
    @cache
    def path(name):
        file = Path(os.environ.get("VIBENCH_PUBLIC_DATA", "")) / FILES[name]
        if "VIBENCH_PUBLIC_DATA" not in os.environ or not file.exists():
            pytest.skip(f"VIBENCH_PUBLIC_DATA names no folder with {file.name}: see the docstring")
        meaning = load_toml(MAPPINGS / f"{name}.toml", ImportMapping)
        return import_recording(file, meaning, tmp_path_factory.mktemp(name) / "made.h5")

    return path


@pytest.fixture(scope="session")
def analysis_of(imported_path):
    @cache
    def analysis(name):
        return analyse(imported_path(name), REQUESTS.get(name, FrequencyResponseRequest()))

    return analysis


# (mapping, published frequency [Hz] and damping ratio, largest differences); None: modes overlap.
MODES = [
    ("tool_hammer", 1074.0, 0.0340, 0.004, 0.07),
    ("tool_hammer", 1961.0, None, 0.014, None),
    ("tool_hammer", 2617.0, None, 0.006, None),
    ("silverbox_low", 68.58, 0.0468, 0.003, 0.05),
    ("silverbox_high", 68.58, 0.0468, 0.014, 0.06),
]


@pytest.mark.parametrize(("name", "frequency_hz", "damping_ratio", "by", "damping_by"), MODES)
def test_a_mode_in_published_data_is_found(analysis_of, name, frequency_hz, damping_ratio, by, damping_by):
    found = min(analysis_of(name).response.resonances, key=lambda each: abs(each.frequency_hz - frequency_hz))
    assert found.frequency_hz == pytest.approx(frequency_hz, rel=by)
    if damping_ratio is not None:
        assert found.damping_ratio == pytest.approx(damping_ratio, rel=damping_by)
    assert np.isinf(found.sd_damping_ratio) == (name == "tool_hammer")


@pytest.mark.parametrize(
    ("low_hz", "high_hz", "line_hz", "height", "damping_ratio"),
    [
        (950, 1200, 1074.0, 0.6433e-6, 0.0340),
        (1850, 2150, 1961.0, 0.2138e-6, 0.0454),
        (2450, 2850, 2617.0, 0.2180e-6, 0.0453),
    ],
)
def test_the_response_to_a_hammer_hit_has_the_published_peaks(
    analysis_of, low_hz, high_hz, line_hz, height, damping_ratio
):
    """The authors read the extremes of real and imaginary part; this test does so in our estimate."""
    band = analysis_of("tool_hammer").response.frequency_response.between(low_hz, high_hz)
    # With this mapping, the transmission is i w times acceleration over force.
    receptance = 1j * band.value / (2 * np.pi * band.frequency_hz) ** 3
    places = (receptance.imag.argmin(), receptance.real.argmax(), receptance.real.argmin())
    line, rise, fall = (band.frequency_hz[place] for place in places)
    assert line == pytest.approx(line_hz, rel=0.012)
    assert -receptance.imag.min() == pytest.approx(height, rel=0.05)
    assert (fall - rise) / (2 * line) == pytest.approx(damping_ratio, rel=0.07)


# Sum of all samples in g by the test of the package; rms of each channel [m/s2] by pyuff 2.5 from the copy
# that its authors repaired.
def test_the_samples_of_a_real_tdms_file_have_the_published_sum(imported_path):
    with open_recording(imported_path("tower_tdms")) as recording:
        assert (recording.sample_rate_hz, recording.samples) == (30.0, 18_000)
        total = sum(np.sum(recording.read(role, 0, recording.samples)) for role in recording.roles)
    assert total / 9.80665 == pytest.approx(-15.59784792, abs=2e-8)


def test_the_samples_of_a_real_universal_file_have_the_levels_that_pyuff_reads(imported_path):
    with open_recording(imported_path("four_points_uff")) as recording:
        samples = [recording.read(role, 0, recording.samples) for role in recording.roles]
        assert (recording.sample_rate_hz, recording.samples) == (3200.0, 222_400)
    found = [np.sqrt(np.mean(each**2)) for each in samples]
    assert found == pytest.approx([0.0790084, 0.3185365, 0.0792455, 0.1308404], abs=6e-8)


def test_the_f16_mapping_reads_the_documented_file_layout(tmp_path):
    untried = load_toml(MAPPINGS / "f16_sweep.toml", ImportMapping)
    known = np.random.default_rng(1).standard_normal((3, 108_477))
    content = {"Force": known[:1], "Voltage": known[:1], "Acceleration": known, "Fs": 400.0}
    savemat(tmp_path / "sweep.mat", content)
    made = import_recording(tmp_path / "sweep.mat", untried, tmp_path / "made.h5")
    with open_recording(made) as recording:
        read = recording.read("m0_velocity", 0, recording.samples)
    np.testing.assert_allclose(read, known[1], atol=1e-8)
