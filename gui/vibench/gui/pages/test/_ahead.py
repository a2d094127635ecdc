"""What is worked out about a test in another process: its outlook, and what the specimen will do."""

from dataclasses import dataclass

from vibench.acquisition.plan import Measurement, MeasurementPreview, preview_measurement
from vibench.acquisition.rig import Rig
from vibench.analysis import MeasurementPrediction, predict_measurement


@dataclass(frozen=True)
class TestPreview:
    """A test on a rig."""

    measurement: Measurement
    rig: Rig


def preview_test(ahead: TestPreview) -> MeasurementPreview:
    """Work out signal, loads, time and size."""
    return preview_measurement(ahead.measurement, ahead.rig)


def predict_test(ahead: TestPreview) -> MeasurementPrediction:
    """Simulate what the specimen will do."""
    return predict_measurement(ahead.measurement, ahead.rig)
