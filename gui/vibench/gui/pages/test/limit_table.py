"""The limits: what the test is predicted to do, beside what the rig survives."""

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QTableWidgetItem

from vibench.acquisition.plan import LimitCheck, LimitSide

from ...plots.bar_delegate import SHARE_ROLE, BarDelegate
from ...widgets.read_table import ReadTable
from ...widgets.units import fitted_unit

_USED = 0
_LEAST_LETTERS = 10
_SIGNS = {LimitSide.AT_MOST: "≤", LimitSide.AT_LEAST: "≥"}


class LimitTable(ReadTable):
    """One row a limit, the most used first."""

    def __init__(self) -> None:
        super().__init__("Predicted loads and limits", ("used", "quantity", "predicted", "limit"), wide=1)
        self.setItemDelegateForColumn(_USED, BarDelegate(self))
        # In a small window the limits are scrolled to: what they are of must be read in any.
        self.horizontalHeader().setMinimumSectionSize(_LEAST_LETTERS * self.fontMetrics().averageCharWidth())

    def show_checks(self, checks: tuple[LimitCheck, ...]) -> None:
        """Show what was held against the rig."""
        units = [fitted_unit(check.unit, check.limit) for check in checks]
        self.show_rows(
            [
                (
                    f"{100 * check.use:.1f} %",
                    f"{_mark(check)}{_short(check.what)}",
                    unit.text(check.value),
                    f"{_SIGNS[check.side]} {unit.text(check.limit)}",
                )
                for check, unit in zip(checks, units, strict=True)
            ],
            [f"{check.what}\nLimit from: {check.source}{_remedy(check)}" for check in checks],
        )
        for row, check in enumerate(checks):
            item = self.item(row, _USED)
            if isinstance(item, QTableWidgetItem):
                item.setData(SHARE_ROLE, float(check.use))
                item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)


def _remedy(check: LimitCheck) -> str:
    return "" if check.is_kept else f"\nTo do: {check.remedy}"


def _mark(check: LimitCheck) -> str:
    if check.is_kept:
        return ""
    return "✖ " if check.forbids else "⚠ "


def _short(what: str) -> str:
    return what.removeprefix("the ").replace("(at ", "(").replace("(about, at ", "(about, ").replace("_", " ")
