"""Which campaign's recordings are listed, with how far each campaign is."""

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QWidget

from ...forms import Choice
from ._listing import ListedCampaign

ALL = "All recordings"


class CampaignChoice(Choice):
    """All recordings, or those of one campaign; hidden in a folder without campaigns."""

    chosen = Signal(object)
    """Files of the campaign as a set, None for all."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Campaign")
        self.setToolTip("List the recordings of one campaign")
        self.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(22)
        self._campaigns: tuple[ListedCampaign, ...] = ()
        self.currentIndexChanged.connect(lambda _index: self._choose())
        self.hide()

    def offer(self, campaigns: tuple[ListedCampaign, ...]) -> None:
        """Offer what was found; the one that was chosen stays so."""
        before = self.currentIndex()
        name = self._campaigns[before - 1].name if before > 0 else ""
        self._campaigns = campaigns
        blocked = self.blockSignals(True)
        self.clear()
        self.addItems([ALL, *(each.text for each in campaigns)])
        names = [each.name for each in campaigns]
        self.setCurrentIndex(names.index(name) + 1 if name in names else 0)
        self.blockSignals(blocked)
        self.setVisible(bool(campaigns))
        self._choose()

    def _choose(self) -> None:
        place = self.currentIndex()
        self.chosen.emit(self._campaigns[place - 1].files if place > 0 else None)
