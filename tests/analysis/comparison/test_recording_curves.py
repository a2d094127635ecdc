import pickle

import numpy as np
import pytest

from vibench.analysis import (
    CurveKind,
    CurveOrigin,
    Estimator,
    FrequencyResponseRequest,
    NotEnoughData,
    Simulation,
    compare_recording,
)
from vibench.analysis.results.compared_recording import stored_result


@pytest.fixture(scope="module")
def comparison(streamed_file):
    return compare_recording(streamed_file(), FrequencyResponseRequest(), Simulation.LEFT_OUT)


@pytest.mark.thorough
def test_a_transmission_curve_sent_to_another_process_keeps_its_bounds(comparison):
    (curve,) = pickle.loads(pickle.dumps(comparison)).curves
    assert (curve.origin, curve.response) == (CurveOrigin.MEASURED, CurveKind.TRANSMISSIBILITY)
    assert np.median(curve.magnitude) == pytest.approx(2.0, rel=0.01)
    assert curve.name == "streamed, transmission, measured"
    assert (curve.lower < curve.magnitude).all()
    assert "drive" in curve.note


@pytest.mark.thorough
def test_a_comparison_keeps_the_whole_result_for_reports(comparison):
    result, failures = stored_result(comparison)
    assert result.analysis.facts.name == comparison.name == "streamed"
    assert failures == ()


def test_a_comparison_uses_the_requested_estimator(streamed_file):
    found = compare_recording(
        streamed_file(), FrequencyResponseRequest(estimator=Estimator.H1, averages=10), Simulation.LEFT_OUT
    )
    assert found.curves[0].note.startswith("h1, ")


def test_a_recording_that_is_too_short_is_reported(streamed_file):
    with pytest.raises(NotEnoughData, match="streamed"):
        compare_recording(streamed_file(samples=10), FrequencyResponseRequest(), Simulation.LEFT_OUT)
