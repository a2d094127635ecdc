"""Markup and control characters in names and messages have no effect."""

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import Qt as Text, QTextDocument

from vibench.analysis import Curve, CurveKind, CurveOrigin
from vibench.gui.pages.compare.curve_plots import CurveList, PairBox
from vibench.gui.pages.rig import RigChoice
from vibench.gui.plots.axis import TIME, PlotAxis
from vibench.gui.plots.line_style import LIMIT, curve_style
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.boxes import ElidedLabel
from vibench.gui.widgets.notice import Notice, NoticeKind
from vibench.gui.widgets.read_table import ReadTable
from vibench.gui.widgets.theme import LIGHT
from vibench.gui.widgets.units import SentenceLabel
from vibench.gui.window.banner import MessageStrip, StatusField, StatusLine

HOSTILE = "<img src='x'><h1>a\x1b[2J\u202eb\x9d</h1>"
SHOWN = r"<img src='x'><h1>a\x1b[2J\u202eb\x9d</h1>"


def read(tip):
    """Return the text that a tooltip shows."""
    document = QTextDocument()
    if Text.mightBeRichText(tip):
        document.setHtml(tip)
    else:
        document.setPlainText(tip)
    return document.toPlainText()


@pytest.mark.parametrize("kind", [ElidedLabel, SentenceLabel])
def test_labels_show_markup_in_foreign_text_as_plain_text(closing, kind):
    label = closing(kind(HOSTILE))
    label.setToolTip(HOSTILE)
    assert label.text() == SHOWN
    assert label.textFormat() is Qt.TextFormat.PlainText
    assert read(label.toolTip()) == SHOWN


def test_tables_show_markup_as_plain_text(closing):
    table = closing(ReadTable("findings", ("what",)))
    table.show_rows([(HOSTILE,)])
    assert table.item(0, 0).text() == SHOWN
    assert read(table.item(0, 0).toolTip()) == SHOWN


def test_messages_and_status_show_markup_as_plain_text(qtbot):
    strip, status = MessageStrip(), StatusLine()
    qtbot.addWidget(strip)
    qtbot.addWidget(status)
    strip.say(Notice(NoticeKind.FAULT, HOSTILE))
    status.show_fields({StatusField.FILE: HOSTILE})
    assert SHOWN in strip._text.text()
    assert SHOWN in read(strip._text.toolTip())
    assert status.labels[StatusField.FILE].text() == SHOWN
    assert read(status.labels[StatusField.FILE].toolTip()) == SHOWN


def curve(source):
    ones = np.ones(2)
    return Curve(source, CurveOrigin.MEASURED, CurveKind.RESPONSE_II, ones, ones, ones)


def test_curve_lists_show_markup_as_plain_text(qtbot):
    curves, pair = CurveList(LIGHT), PairBox()
    qtbot.addWidget(curves)
    qtbot.addWidget(pair)
    made = (curve(HOSTILE), curve("other"))
    curves.replace_source(HOSTILE, made)
    pair.offer(made, made)
    assert curves.item(0).text() == f"{SHOWN}, Response II, measured"
    assert pair.pair() == (made[1], made[0])


def test_plots_show_markup_in_names_and_units_as_plain_text(closing):
    plot = closing(Plot("picture", TIME, PlotAxis("velocity", HOSTILE), LIGHT).with_legend())
    plot.curve(curve_style(0), HOSTILE).setData([0.0, 1.0], [1.0, 1.0])
    plot.curve(curve_style(1), "other").setData([0.0, 1.0], [2.0, 2.0])
    line = plot.upright(LIMIT, 0.5, "{" + HOSTILE)
    plot.resize(1400, 1400)
    plot.show()
    assert SHOWN in plot._legend.accessibleName()
    assert SHOWN in read(plot._legend.text()).replace("\xa0", " ")
    assert read(plot.up.labelString()) == f"velocity ({SHOWN})"
    assert line.label.toPlainText() == "{" + SHOWN


def test_rig_lists_show_markup_as_plain_text(closing, tmp_path):
    choice = closing(RigChoice())
    choice._add(tmp_path / "<h1>a\u202eb.toml")
    last = choice._box.count() - 1
    assert choice._box.itemText(last) == r"<h1>a\u202eb"
    tip = choice._box.itemData(last, Qt.ItemDataRole.ToolTipRole)
    assert read(tip) == str(tmp_path / r"<h1>a\u202eb.toml")
