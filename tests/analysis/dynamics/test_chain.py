"""Chain requests: units, recorded drives, files and figures."""

import numpy as np
import pytest
from pydantic import ValidationError

from vibench.analysis.dynamics import ChainDrive, ChainRequest, chain_answer
from vibench.analysis.report import chain_figure
from vibench.sim import LinearSweep, SpecimenTable, gong2025
from vibench.sim.chain import chain_energies, chain_of, chain_transmissibility, integrate_chain
from vibench.sim.chain._target import error_of_lines

pytestmark = pytest.mark.timeout(300)
"""The first run compiles the kernels of chains."""


@pytest.fixture(scope="module")
def swept_chain():
    """Swept response of a chain of three colliding cells."""
    return chain_answer(
        ChainRequest(
            lengths=(3,), drive="swept", start_hz=150.0, stop_hz=600.0, duration_s=3.0, amplitude_m=10e-6
        )
    )


def test_a_swept_chain_reports_its_simulated_motion(swept_chain):
    (run,) = swept_chain.runs
    drive, chain = LinearSweep(150.0, 600.0, 3.0, 10e-6), chain_of(gong2025(), 3)
    alone = integrate_chain(chain, drive, 3.0, sample_rate_hz=20e3)
    np.testing.assert_array_equal(run.impacts, alone.impacts.per_cell)
    assert run.impacts.sum() > 100
    base = drive.amplitude_m * np.sin(2.0 * np.pi * drive.turns(alone.time_s))
    mean = chain_energies(chain, alone.states, base).mean(axis=0)
    assert np.all(np.abs(run.energy_j - mean) < 0.05 * mean)
    assert np.all(run.energy_error_j > 0.0)


def test_the_chain_figure_shades_band_gaps_and_tabulates_its_curves(swept_chain):
    drawn = chain_figure(swept_chain)
    waves, across, cells = drawn.tables
    assert len(across.column("transmission")) == 3 * len(swept_chain.runs[0].over_hz)
    assert cells.column("impacts") == tuple(swept_chain.runs[0].impacts)
    assert max(waves.column("wave_number_rad")) == pytest.approx(np.pi)
    assert "96.07 to 110.4 Hz" in drawn.caption
    assert drawn.png.startswith(b"\x89PNG")


@pytest.mark.thorough
def test_a_chain_driven_by_recorded_noise_has_the_linear_transmission(noise_file):
    found = chain_answer(
        ChainRequest(lengths=(2,), drive="recorded", recording=str(noise_file()), duration_s=60.0)
    )
    (run,) = found.runs
    assert run.impacts.sum() == 0
    linear = np.abs(chain_transmissibility(chain_of(gong2025(), 2), run.over_hz)[:, :, 0])
    is_known = np.isfinite(run.transmission).all(axis=1) & (run.over_hz > 60.0) & (run.over_hz < 500.0)
    assert is_known.sum() > 20
    assert np.median(np.abs(run.transmission[is_known] / linear[is_known] - 1.0)) < 0.1
    assert chain_figure(found).svg


def test_alternating_cells_repeat_along_the_chain_and_changed_values_apply_to_all_cells():
    others = (SpecimenTable.model_validate("heavy"), SpecimenTable.model_validate("asymmetric"))
    request = ChainRequest(others=others, lengths=(5,), gap_m=30e-6)
    chain = request.chain(5)
    assert [cell.masses[0] for cell in chain.cells] == [5.8e-3, 58e-3, 5.8e-3, 5.8e-3, 58e-3]
    assert {cell.gaps_m for cell in chain.cells} == {(30e-6, 30e-6)}
    assert chain_answer(request.model_copy(update={"drive": ChainDrive.NONE})).bands_hz.shape[1] == 9


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"start_hz": 300.0, "stop_hz": 200.0}, "does not ascend"),
        ({"drive": "swept"}, "has no range"),
        ({"drive": "recorded"}, "no recording was given"),
        ({"model": "rigid:0.8"}, "rigid stops"),
        ({"lengths": ()}, "at least 1 item"),
        ({"start_hz": 10.0, "stop_hz": 300.0, "step_hz": 1e-3}, "take a larger step"),
    ],
)
def test_an_invalid_chain_request_is_refused_with_a_readable_message(options, said):
    with pytest.raises(ValidationError, match=said):
        ChainRequest(**options)


def test_a_steady_chain_reaches_a_target_error():
    request = ChainRequest(lengths=(2,), start_hz=220.0, stop_hz=220.0, amplitude_m=5e-6, error="5 %")
    (run,) = chain_answer(request).runs
    assert np.all(run.transmission_error <= 0.05)
    longer = ChainRequest(
        lengths=(2,), start_hz=220.0, stop_hz=220.0, amplitude_m=5e-6, settle_s=5.0, duration_s=40.0
    )
    (truth,) = chain_answer(longer).runs
    off = np.abs(run.transmission[0] / truth.transmission[0] - 1.0)
    assert np.all(off <= 1.5 * run.transmission_error)
    assert np.all(np.isnan(truth.transmission_error))


def test_the_stated_errors_of_spectral_lines_hold_in_95_percent_of_cases():
    random = np.random.default_rng(5)
    drawn = random.standard_normal((400, 16, 2)) @ np.array([1.0, 1j])
    held = [abs(abs(lines.mean()) / 5.0 - 1.0) <= error_of_lines(lines[:, None])[0] for lines in 5.0 + drawn]
    assert np.mean(held) > 0.94


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"accuracy": "quick"}, "accuracy was given, but the error or time"),
        ({"duration_s": 3.0}, "duration_s was given, but the error or time"),
        ({"drive": "swept", "stop_hz": 300.0}, "needs a steady drive, not swept"),
    ],
)
def test_chain_options_that_an_error_target_fixes_are_refused(given, said):
    with pytest.raises(ValidationError, match=said):
        ChainRequest(**{"error": 0.01, **given})
