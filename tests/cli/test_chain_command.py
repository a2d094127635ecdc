"""`vibench chain` on the command line."""

import re

import h5py
import numpy as np
import pytest

from vibench.sim import Harmonic, gong2025, steady_response
from vibench.sim.chain import chain_of, chain_response, chain_transmissibility

from .in_this_process import invoke, json_of, refusal_of


def test_a_chain_without_a_drive_reports_its_bands_and_band_gaps_and_transmission():
    found = json_of("chain", "--cells", 3)
    assert found["runs"] == []
    assert [round(low, 1) for low, _ in found["gaps_hz"]] == [96.1, 373.4, 701.3]
    assert found["gaps_hz"][-1][1] is None
    expected = np.abs(chain_transmissibility(chain_of(gong2025(), 3), found["linear_hz"])[:, :, 0]).T
    np.testing.assert_allclose(found["linear_transmission"]["3"], expected)


@pytest.mark.thorough
def test_a_steadily_driven_chain_gives_results_for_each_cell_and_a_file(tmp_path):
    options = ("--cells", 2, "--amplitude", 20e-6, "--frequency", 220, "--duration", 0.2, "--settle", 0.1)
    found = json_of("chain", *options, "--out", tmp_path / "out")
    (point,) = found["runs"]
    expected = chain_response(chain_of(gong2025(), 2), Harmonic(220.0, 20e-6), "standard", 0.1 + 0.2, 0.2)
    np.testing.assert_allclose(point["transmission"][0], expected.response_ii[:, 0])
    assert point["impacts"] == expected.impacts.tolist()
    assert min(point["energy_j"]) > 0.0
    names = {each.name for each in (tmp_path / "out").iterdir()}
    assert names >= {"chain.h5", "chain.png", "chain.svg", "chain_waves.csv", "chain_cells.csv"}
    with h5py.File(tmp_path / "out" / "chain.h5") as file:
        assert file.attrs["format"] == "vibench chain"
        np.testing.assert_array_equal(file["run_00000/impacts"], point["impacts"])
        assert file["run_00000/motion_m"].shape[1] == 2
    assert "ever overwritten" in str(invoke("chain", *options, "--out", tmp_path / "out").exception)


def test_a_chain_states_that_it_has_not_settled():
    slow = ("--cells", 8, "--amplitude", 1e-8, "--frequency", 94, "--damping-time", 1e-6)
    assert "not settled, or chaotic: |x/U| later changes by " in str(invoke("chain", *slow).output)
    assert max(json_of("chain", *slow)["runs"][0]["transmission_change"]) > 0.1
    settled = ("chain", "--cells", 2, "--amplitude", 1e-6, "--frequency", 130)
    assert "not settled" not in str(invoke(*settled).output)


def test_a_swept_chain_shows_its_band_gap_and_matches_the_linear_transmission():
    swept = ("--amplitude", 1e-7, "--duration", 4)
    for ends in ("300:600", "600:300"):
        (point,) = json_of("chain", "--cells", 4, *swept, "--frequency", ends)["runs"]
        over_hz, last = np.array(point["over_hz"]), np.array(point["transmission"])[:, -1]
        assert np.all(np.diff(over_hz) > 0.0)
        linear = np.abs(chain_transmissibility(chain_of(gong2025(), 4), over_hz)[:, -1, 0])
        is_broad = np.abs(over_hz - 480.0) > 110.0
        np.testing.assert_allclose(last[is_broad][1:-1], linear[is_broad][1:-1], rtol=0.3)
        assert last[np.argmin(np.abs(over_hz - 405.0))] < 1e-3 * last[np.argmin(np.abs(over_hz - 520.0))]


def test_chains_of_several_lengths_and_of_alternating_cells_can_be_computed():
    options = ("--amplitude", 20e-6, "--frequency", 220, "--duration", 0.1, "--settle", 0, "--gap", 20e-6)
    found = json_of("chain", "--cells", "1,2,3", "--specimen", "gong2025", "--specimen", "heavy", *options)
    assert [each["cells"] for each in found["runs"]] == [1, 2, 3]
    assert len(found["bands_hz"]) == 6
    alone = steady_response(gong2025(gap_m=20e-6), Harmonic(220.0, 20e-6), "standard", 0.1, 0.1)
    # In chaos the same motion, computed differently, is another random sample.
    assert found["runs"][0]["transmission"][0][0] == pytest.approx(alone.response_ii, rel=0.2)
    assert found["options"]["others"][0]["name"] == "heavy"


@pytest.mark.thorough
@pytest.mark.parametrize("frequency", ["220", "200:300"])
def test_a_diverged_chain_run_reports_only_how_it_ended(frequency, tmp_path, monkeypatch):
    monkeypatch.setattr("vibench.sim.specimen.drive.LARGEST_AMPLITUDE_M", 1e100)
    drive = ("--amplitude", 1e100, "--frequency", frequency)
    options = ("--cells", 2, *drive, "--duration", 0.2, "--settle", 0.1)
    found = json_of("chain", *options, "--out", tmp_path / "out")
    (point,) = found["runs"]
    assert point["outcome"] != "reached the end time"
    assert point["energy_j"] == point["transmission"][0] == [None, None]
    assert (tmp_path / "out" / "chain.png").is_file()
    assert "1 run ended early" in invoke("chain", *options).output


def test_a_chain_run_that_is_too_short_for_an_error_states_that_the_error_is_not_known():
    found = invoke("chain", "--cells", 1, "--amplitude", 1e-6, "--frequency", 130, "--time", "1ms")
    assert "no error is known after" in found.output
    assert not re.search(r"\binf\b", found.output)


def test_the_exponent_of_a_chain_is_reported():
    result = invoke(
        "chain", "--cells", 2, "--amplitude", 20e-6, "--frequency", 220, "--duration", 0.05, "--settle", 0.05,
        "--exponent", 0.4,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "2 cells at 220 Hz: |x/U|" in result.output
    assert "exponent" in result.output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--cells", "x"), "--cells was given as 'x'"),
        (("--cells", "0"), "--cells was given as '0'; give a whole number from 1 to 1000"),
        (("--cells", "1001"), "--cells was given as '1001'; give a whole number from 1 to 1000"),
        (("--cells", "2,,4"), "--cells was given as '2,,4'"),
        (("--amplitude", "1e-6"), "one of --amplitude and --frequency is missing"),
        (("--amplitude", "1e-6", "--frequency", "200:200"), "200 is not below 200"),
        (("--amplitude", "1e-6", "--frequency", "a:b"), "'a' is not a number"),
        (("--amplitude", "1e-6:2e-6", "--frequency", "200"), "2 numbers are not allowed here"),
        (("--recording", "a.h5", "--frequency", "200"), "which defines the base motion"),
        (("--recording", "nowhere.h5"), "nowhere.h5"),
        (("--specimen", "rigid_stops"), "Cell 1 has rigid stops"),
        (("--specimen", "nothing"), "no specimen is called 'nothing'"),
        (("--cells", "200", "--amplitude", "1e-6", "--frequency", "200:300", "--duration", "99"), "numbers"),
        (
            ("--cells", "2", "--amplitude", "1e-6", "--frequency", "200", "--exponent", "0.01"),
            "contain 32 to 1000000 intervals",
        ),
    ],
)
def test_invalid_options_are_refused_with_a_readable_message(arguments, said):
    assert said in refusal_of("chain", *arguments)
