"""The navigation bar: the job in order, page by page, with ticks; no page is ever locked."""

from PySide6.QtCore import QEvent, Qt, Signal
from PySide6.QtWidgets import QListWidget, QListWidgetItem, QSizePolicy

DONE = "✔"


class NavigationBar(QListWidget):
    """Names of the pages; the chosen one is shown."""

    chosen = Signal(str)

    def __init__(self, names: tuple[str, ...]) -> None:
        super().__init__()
        self.setObjectName("rail")
        self.setAccessibleName("Pages")
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)
        self._names = names
        self._done: dict[str, bool] = {}
        for number, name in enumerate(names, start=1):
            item = QListWidgetItem()
            item.setToolTip(f"{name} page (Ctrl+{number})")
            self.addItem(item)
        self.show_done({})
        self.currentRowChanged.connect(self._chosen)

    @property
    def chosen_name(self) -> str:
        """The page that is marked."""
        return self._names[self.currentRow()] if self.currentRow() >= 0 else ""

    def choose(self, name: str) -> None:
        """Mark a page as the one that is shown."""
        self.setCurrentRow(self._names.index(name))

    def show_done(self, done: dict[str, bool]) -> None:
        """Tick what is done."""
        if done == self._done and self.item(0).text():
            return
        self._done = done
        for row, name in enumerate(self._names):
            tick = DONE if done.get(name) else " "
            self.item(row).setText(f"{row + 1}  {name}  {tick}")
            spoken = f"{name}, done" if done.get(name) else name
            self.item(row).setData(Qt.ItemDataRole.AccessibleTextRole, spoken)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """Follow the font at once."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.FontChange and self.count():
            self._fit()

    def _fit(self) -> None:
        """As wide as its longest name in bold with a tick: bold is what the chosen one is."""
        bold = self.font()
        bold.setBold(True)
        metrics = self.fontMetrics()
        longest = max(self._names, key=metrics.horizontalAdvance)
        em = metrics.height()
        self.setFixedWidth(round(metrics.horizontalAdvance(f"8  {longest}  {DONE}") * 1.15) + 2 * em)

    def _chosen(self, row: int) -> None:
        if row >= 0:
            self.chosen.emit(self._names[row])
