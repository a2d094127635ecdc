"""What is worked out about a test in another process: its outlook, and what the specimen will do."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import vibench.analysis
from vibench.acquisition.plan import Measurement, MeasurementPreview, preview_measurement
from vibench.acquisition.rig import Rig

if TYPE_CHECKING:
    from vibench.analysis import MeasurementPrediction


@dataclass(frozen=True)
class TestPreview:
    """A test on a rig."""

    measurement: Measurement
    rig: Rig


def preview_test(test: TestPreview) -> MeasurementPreview:
    """Work out signal, loads, time and size."""
    return preview_measurement(test.measurement, test.rig)


def predict_test(test: TestPreview) -> "MeasurementPrediction":
    """Simulate what the specimen will do."""
    return vibench.analysis.predict_measurement(test.measurement, test.rig)
