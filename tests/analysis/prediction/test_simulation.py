"""Simulation requests of a user, and the result while it grows; linear scenes need no compilation."""

import re
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from vibench.analysis.prediction.progress import (
    MEASURED,
    SimulatedPoint,
    SimulationProgress,
    SimulationRequest,
    Trouble,
    cost_sentences,
)
from vibench.analysis.prediction.worker import answer, simulate
from vibench.sim import Accuracy, base_transmissibility, gong2025, load_specimen
from vibench.sim.background import Pool

LINEAR = {"model": "linear", "compared_with": "", "signal_hz": None, "step_hz": 50.0, "start_hz": 50.0}


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"model": "rubber"}, "not known"),
        ({"compared_with": "power:x"}, "not known"),
        ({"start_hz": 200.0, "stop_hz": 100.0}, "start must not be above stop"),
        ({"step_hz": 0.001}, "at most 20000"),
        ({"window_s": 50.0}, "Window 50.0 s is not allowed"),
        ({"gap_m": -1.0}, "greater than 0"),
    ],
)
def test_invalid_simulation_requests_are_refused_with_a_reason(given, said):
    with pytest.raises(ValidationError, match=re.escape(said)):
        SimulationRequest(**given)


def test_a_model_that_is_named_twice_is_simulated_once():
    assert SimulationRequest(compared_with="hertz").models == ("hertz",)
    assert SimulationRequest(step_hz=50.0).points == 24


def test_a_result_computed_point_by_point_equals_the_linear_transmission_at_the_end():
    request = SimulationRequest(**LINEAR)
    progress, counts = SimulationProgress(request.amplitude_m, request.points, "n"), []
    simulate(request, lambda parts: (progress.add(parts), counts.append(progress.done)), lambda: False, 2)
    assert counts[-1] == progress.requested == 12
    frequency_hz, found = progress.column("linear", "response_ii")
    exact = np.abs(base_transmissibility(gong2025(contact="linear"), frequency_hz)[:, 0])
    assert np.array_equal(frequency_hz, np.arange(50.0, 601.0, 50.0))
    assert np.allclose(found, exact, rtol=1e-6)
    trace = progress.curves()[1]
    assert np.array_equal(trace.magnitude, found)
    assert trace.name == "model linear, 5 µm, Response II, predicted"


def test_the_simulation_uses_the_specimen_given_by_a_name_or_a_file(tmp_path):
    """Shipped specimens are given by name, other specimens by file."""
    file = tmp_path / "own.toml"
    file.write_text(
        'model = "gong2025"\nmasses_kg = [0.0061, 0.0019, 0.0025]\n'
        "single_frequencies_hz = [322.0, 100.0, 390.6]\ndamping_time_s = 2e-5\n",
        encoding="utf-8",
    )
    answers = []
    for named in ("gong2025", str(file)):
        request = SimulationRequest(specimen=named, **LINEAR)
        progress = SimulationProgress(request.amplitude_m, request.points, "n")
        simulate(request, progress.add, lambda: False, 2)
        frequency_hz, found = progress.column("linear", "response_ii")
        own = load_specimen(named).specimen(contact="linear")
        assert np.allclose(found, np.abs(base_transmissibility(own, frequency_hz)[:, 0]), rtol=1e-6)
        answers.append(found)
    assert not np.allclose(answers[0], answers[1], rtol=0.01)
    with pytest.raises(ValidationError, match="nowhere"):
        SimulationRequest(specimen="nowhere.toml", **LINEAR)


def test_no_point_is_computed_after_a_cancellation():
    told = []
    simulate(SimulationRequest(**LINEAR), told.append, lambda: True, 1)
    assert sum(len(parts) for parts in told) < 12


def point(model, frequency_hz, response, impacts=0):
    return SimulatedPoint(model, frequency_hz, response, response, impacts, -3.5)


def test_similarity_uses_the_frequencies_common_to_both_models():
    progress = SimulationProgress(5e-6, 10, "n")
    progress.add((point("a", 100.0, 2.0), point("a", 200.0, 4.0), point("b", 200.0, 4.0)))
    assert progress.similarity().rate == 1.0
    progress.add((point("b", 100.0, 200.0), Trouble("b at 300 Hz: no")))
    assert progress.similarity().rate == 0.5
    assert progress.done == 5
    assert progress.troubles == ("b at 300 Hz: no",)


def test_separate_bands_of_impacts_are_reported_separately():
    progress = SimulationProgress(5e-6, 10, "n")
    progress.add(tuple(point("a", float(f), 1.0, int(f in (30, 40, 60))) for f in range(10, 80, 10)))
    assert progress.collision_bands_hz("a") == ((30.0, 40.0), (60.0, 60.0))


def is_about(found, stated):
    """Return whether a value is within a factor of 5 of the accuracy page, which is measured at intervals."""
    return found == stated or stated / 5 < found < 5 * stated


def test_stated_costs_and_errors_match_the_accuracy_page():
    page = (Path(__file__).parents[3] / "docs" / "accuracy.md").read_text()
    sections = {
        "free": "## No contact: hertz, 260 Hz, 1 µm",
        "periodic": "## Periodic: hertz, 130 Hz, 20 µm",
        "chaos": "## Chaos: hertz, 260 Hz, 5 µm",
        "power": "## Periodic: power:3, 150 Hz, 10 µm",
    }
    for accuracy, level in MEASURED.items():
        for name, heading in sections.items():
            section = page[page.index(heading) :]
            row = re.search(rf"\| \*\*{accuracy.value}\*\* \|([^\n]*)", section)[1].split("|")
            assert is_about(float(row[0]), getattr(level, name))
            if name == "periodic":
                assert is_about(float(row[1]), level.state_error)
                assert is_about(float(row[2]), level.response_i_error)


def test_the_stated_cost_is_larger_for_a_higher_accuracy():
    levels = (Accuracy.QUICK, Accuracy.REFERENCE)
    quick, strict = (cost_sentences(SimulationRequest(accuracy=each), 2) for each in levels)
    for accuracy, said in zip(levels, (quick, strict), strict=True):
        assert f"{MEASURED[accuracy].chaos:.0f} s of chaos" in said[1]
        assert f"{MEASURED[accuracy].state_error:.0e}" in said[2]
    assert MEASURED[Accuracy.REFERENCE].chaos < MEASURED[Accuracy.QUICK].chaos


@pytest.mark.thorough
def test_a_short_request_completes_after_a_long_request_is_dropped():
    """In a real worker process the short request returns all its points."""
    first, second, pool = [], [], Pool(1)
    long = SimulationRequest(**{**LINEAR, "step_hz": 0.05})
    dropped = pool.stream(answer, first.extend, first.append, first.append, long)
    while not first:
        pool.poll(0.1)
    dropped.drop()
    job = pool.stream(answer, second.extend, second.append, second.append, SimulationRequest(**LINEAR))
    while not job.is_over:
        pool.poll(0.1)
    pool.close()
    assert 0 < len(first) < 11_001
    assert len(second) == 12 + 1
    assert second[-1] is None


def test_a_target_error_overrides_accuracy_and_duration():
    request = SimulationRequest(**LINEAR, error="1 %", time_s="2 s", accuracy="quick", duration_s=4.0)
    assert request.study.target is not None
    assert (request.study.error, request.study.time_s, request.study.accuracy) == (0.01, 2.0, "standard")
    assert cost_sentences(request, 2) == ("12 points, each to an error of 1 % within 2 s, on 2 idle cores.",)
