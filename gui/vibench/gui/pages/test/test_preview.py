"""Preview and prediction of a test, which run in another process."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import vibench.analysis
from vibench.acquisition import AcquisitionError
from vibench.acquisition.plan import Measurement, MeasurementPreview, preview_measurement
from vibench.acquisition.rig import Rig

if TYPE_CHECKING:
    from vibench.analysis import ExpectedResult, MeasurementPrediction


TestRequest = tuple[Measurement, Rig]
"""A test, and the rig on which it will run."""


def preview_test(request: TestRequest) -> MeasurementPreview:
    """Return signal, loads, duration and file size of a test."""
    return preview_measurement(*request)


@dataclass(frozen=True, eq=False)
class TestPrediction:
    """Predicted response to a test, with the expected uncertainty of its results."""

    motion: "MeasurementPrediction"
    expected: tuple["ExpectedResult", ...]
    recorded_s: float | None
    """Predicted recording time of a test with `until` [s]; None if unknown, or if `until` is not set."""
    refusal: str
    """Why feedback control on this rig cannot stabilise the motion; empty if feedback can do this."""


def predict_test(request: TestRequest) -> TestPrediction:
    """Simulate the response of the specimen, and predict uncertainty and recording time."""
    (measurement, rig), refusal = request, ""
    try:
        measurement.excitation.require_holdable(rig)
    except AcquisitionError as error:
        refusal = f"{error}"
    return TestPrediction(
        vibench.analysis.predict_measurement(measurement, rig),
        vibench.analysis.expected_uncertainty(measurement, rig),
        vibench.analysis.expected_recorded_s(measurement, rig),
        refusal,
    )
