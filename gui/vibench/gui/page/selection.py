"""What a person means to do: rig, test and campaign as they are being made. Nothing of it has been sent."""

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from vibench.acquisition.plan import Campaign, Measurement
from vibench.acquisition.rig import Rig

if TYPE_CHECKING:
    from vibench.analysis import MeasurementPrediction


class Selection(QObject):
    """Values that several pages work on; each is whole and valid, or None."""

    rig_changed = Signal()
    measurement_changed = Signal()
    campaign_changed = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._rig: Rig | None = None
        self._measurement: Measurement | None = None
        self._campaign: Campaign | None = None
        self._prediction: MeasurementPrediction | None = None

    @property
    def rig(self) -> Rig | None:
        """The rig that was chosen, open or not."""
        return self._rig

    @property
    def measurement(self) -> Measurement | None:
        """The test on the Test page; None while something in it is not allowed."""
        return self._measurement

    @property
    def prediction(self) -> "MeasurementPrediction | None":
        """What the specimen is predicted to do under the test; None while nobody knows."""
        return self._prediction

    @property
    def campaign(self) -> Campaign | None:
        """The campaign on the Queue page."""
        return self._campaign

    def choose_rig(self, rig: Rig | None) -> None:
        """Mean another rig."""
        if rig != self._rig:
            self._rig = rig
            self.rig_changed.emit()

    def choose_measurement(self, measurement: Measurement | None) -> None:
        """Mean another test."""
        if measurement != self._measurement:
            self._measurement, self._prediction = measurement, None
            self.measurement_changed.emit()

    def keep_prediction(self, prediction: "MeasurementPrediction") -> None:
        """Keep what is predicted of the test."""
        self._prediction = prediction

    def choose_campaign(self, campaign: Campaign | None) -> None:
        """Mean another campaign."""
        if campaign != self._campaign:
            self._campaign = campaign
            self.campaign_changed.emit()
