"""The limits: what the test is predicted to do, beside what the rig survives."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QTableWidgetItem, QWidget

from acquisition.plan.limits import LimitCheck

from ...plots.bar_delegate import SHARE_ROLE, BarDelegate
from ...read_table import ReadTable

_USED = 0


class LimitTable(ReadTable):
    """One row a limit, the most used first."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Predicted loads and limits", ("used", "quantity", "predicted", "limit"), parent)
        self.setItemDelegateForColumn(_USED, BarDelegate(self))

    def show_checks(self, checks: tuple[LimitCheck, ...]) -> None:
        """Show what was held against the rig."""
        self.show_rows(
            [
                (
                    f"{100 * check.use:.1f} %",
                    check.what if check.is_kept else f"✖ {check.what}",
                    f"{check.value:.3g} {check.unit}",
                    f"{check.side.value} {check.limit:.3g} {check.unit}",
                )
                for check in checks
            ]
        )
        for row, check in enumerate(checks):
            for column in range(self.columnCount()):
                item = self.item(row, column)
                if isinstance(item, QTableWidgetItem):
                    remedy = "" if check.is_kept else f"\nTo do: {check.remedy}"
                    item.setToolTip(f"{check.what}\nLimit from: {check.source}{remedy}")
                    item.setData(SHARE_ROLE, float(check.use) if column == _USED else None)
                    if column == _USED:
                        item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)
