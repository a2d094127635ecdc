"""A change of units applies to every page and changes no value."""

import re

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractItemView,
    QAbstractSpinBox,
    QComboBox,
    QLabel,
    QLineEdit,
    QTableView,
    QWidget,
)

from vibench.acquisition import shipped
from vibench.acquisition.engine import ArmedPlan, EngineState, EngineStatus, Supervision, TwinStatus
from vibench.acquisition.plan import EXCITATION_KINDS, Dwell, HeldDwell, Measurement
from vibench.acquisition.rig import load_rig
from vibench.analysis import Curve, CurveKind, CurveOrigin
from vibench.analysis.prediction.progress import SettledMotion
from vibench.gui.forms.model_form import ValidatedForm
from vibench.gui.forms.quantity_edit import QuantityEdit, parse_quantity, quantity_text
from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.pages.test.test_page import TestForm as FormOfATest
from vibench.gui.pages.test.test_preview import preview_test
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.notice import COMPARE, FILES, MAPS, QUEUE, RUN, SIMULATE, TEST
from vibench.gui.widgets.units import CHOICES, UNITS, prefixed_unit
from vibench.gui.window.menus import SettingsDialog

OLD = re.compile(r"(?:\d|\()\s?(?:µm|m/s²|m/s2|m s-[12]|mm/s)(?![\w/²·])")
"""Pattern of a number or axis label in a unit that is not chosen."""
DWELL = Dwell(amplitude_vpp=0.5, frequency_hz=260.0, settle_s=1.0, duration_s=6.0)
OTHERS = {"displacements_in": "mm", "velocities_in": "m/s", "accelerations_in": "g"}
USUAL = {"displacements_in": "automatic", "velocities_in": "mm/s", "accelerations_in": "m/s²"}


@pytest.fixture(autouse=True)
def _usual_again():
    yield
    UNITS.choose({})


@pytest.fixture(scope="module")
def full_window(lasting_window, record, tmp_path_factory, wait_for):
    """A window with displacements, velocities and accelerations on every page."""
    window = lasting_window
    pages, context = window.pages, window.context
    rig = load_rig(shipped("hardware_configs/virtual_rig.toml"))
    context.selection.choose_rig(rig)
    form = pages[TEST].form
    form.form.editors["excitation"].kind_choice.setCurrentText("held dwell")
    measurement = form.value
    pages[TEST]._show_preview(preview_test((measurement, rig)))
    lines = ("base held at 5 µm", "stroke 0.05 mm of 5 mm", "acceleration 12.5 m/s² of 60 m/s²")
    armed = ArmedPlan(
        campaign="held",
        folder="",
        lines=lines,
        expires_in_s=30.0,
        attendance=Supervision.ATTENDED,
        patience_s=2.0,
    )
    status = EngineStatus(state=EngineState.ARMED, attendance=Supervision.ATTENDED, armed=armed)
    pages[RUN].arm_card.show_status(status, "held", "")
    twin = TwinStatus(
        state="tracked", run_id=1, end_sample=9, step_s=1e-4, p_m=(0.0, 1e-6), stops_m=(-4e-5, 4e-5),
        forecast_m=(), forecast_error_m=(), numbers=(("lower gap", "(44.001 ± 0.005) µm"),),
    )  # fmt: skip
    pages[RUN].hidden_motion.show_status(status.model_copy(update={"twin": twin}))
    path = record(tmp_path_factory.mktemp("recording"), "a")
    context.recording_requested.emit(path)
    frequency_hz = np.linspace(200.0, 300.0, 50)
    for name in ("model hertz, 5 µm", "model linear, 10 to 20 µm"):
        curve = Curve(
            name, CurveOrigin.PREDICTED, CurveKind.RESPONSE_I, frequency_hz,
            np.hypot(1.0, (frequency_hz - 250.0) / 9.0), np.full(50, 0.01), "A0 = 5 µm", 5e-6 * len(name),
        )  # fmt: skip
        pages[COMPARE].add_prediction((curve,))
    pages[SIMULATE].form.form.show_content({})
    shown = np.linspace(0.0, 1e-5, 50)
    said = "260 Hz, 5 µm, from rest: periodic; gaps 45 and 45 µm"
    pages[MAPS].motion.show_motion(
        SettledMotion(260.0, 5e-6, said, shown, shown, shown, (4.5e-5, 4.5e-5), shown * 1e7, shown)
    )
    pages[QUEUE].open_file(shipped("campaigns/paper.toml"))
    wait_for(lambda: bool(pages[FILES].time_histories.plots))
    return window


def choose_units(context, window, units):
    dialog = SettingsDialog(context, window)
    dialog.form.form.show_content({**dialog.form.form.content(), **units})
    dialog.accept()
    dialog.deleteLater()


def texts_of(page):
    """All texts of a page: labels, fields, lists, tables, axes, tooltips."""
    for widget in (page, *page.findChildren(QWidget)):
        yield widget.toolTip()
        match widget:
            case QLabel() | QLineEdit():
                yield widget.text()
            case QAbstractSpinBox():
                yield widget.lineEdit().text()
            case QComboBox():
                yield from (widget.itemText(n) for n in range(widget.count()))
            case QAbstractItemView() if widget.model() is not None:
                model = widget.model()
                columns = range(model.columnCount() if isinstance(widget, QTableView) else 1)
                places = [model.index(row, each) for row in range(model.rowCount()) for each in columns]
                for role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.ToolTipRole):
                    yield from (str(model.data(place, role) or "") for place in places)
            case Plot():
                for axis in (widget.across, widget.up):
                    yield axis.axis.text
                    yield axis.axis.short_text
                    yield axis.labelText


def form_of_a_kind(closing, kind):
    form = closing(FormOfATest())
    form.show_value(Measurement(name="trial", excitation=DWELL))
    form.form.editors["excitation"].kind_choice.setCurrentText(kind.replace("_", " "))
    return form


def numbers_of(page):
    return [edit.content() for edit in page.findChildren(QuantityEdit)]


@pytest.mark.thorough
def test_a_change_of_units_converts_every_number_and_can_be_undone(full_window):
    before = {name: list(texts_of(page)) for name, page in full_window.pages.items()}
    values = {name: numbers_of(page) for name, page in full_window.pages.items()}
    converted = {name for name, texts in before.items() if any(map(OLD.search, texts))}
    assert converted >= {TEST, RUN, FILES, COMPARE, SIMULATE, MAPS}
    choose_units(full_window.context, full_window, OTHERS)
    for name, page in full_window.pages.items():
        left = [text for text in texts_of(page) if OLD.search(text)]
        assert left == [], name
        assert numbers_of(page) == values[name], name
    now = " | ".join(text for page in full_window.pages.values() for text in texts_of(page))
    for text in (
        "stroke 0.05 mm of 5 mm",
        "acceleration 1.27 g of 6.12 g",
        "(0.044001 ± 0.000005) mm",
        "(g)",
    ):
        assert text in now, text
    choose_units(full_window.context, full_window, USUAL)
    assert {name: list(texts_of(page)) for name, page in full_window.pages.items()} == before


@pytest.mark.parametrize("kind", EXCITATION_KINDS)
def test_every_field_of_a_test_shows_and_reads_the_new_unit(closing, kind):
    form = form_of_a_kind(closing, kind)
    before = form.value
    assert before is not None, form.complaint
    UNITS.choose({"m": "mm", "m/s": "m/s", "m/s²": "g"})
    assert [text for text in texts_of(form) if OLD.search(text)] == []
    for edit in (*form.findChildren(QuantityEdit), *form.findChildren(QLineEdit)):
        edit.editingFinished.emit()
    assert form.value == before
    UNITS.choose({"m": "m"})
    assert form.value == before


def test_lists_of_numbers_are_read_in_the_displayed_unit(closing):
    form = form_of_a_kind(closing, "resonance_tracking")
    levels = form.form.editors["excitation"].form.editors["accelerations_m_per_s2"]
    UNITS.choose({"m/s²": "g"})
    levels.widget.setText("0.1, 0.2 g, 3 m/s²")
    levels.widget.editingFinished.emit()
    assert form.value.excitation.accelerations_m_per_s2 == (0.980665, 1.96133, 3.0)
    levels.widget.setText("0.1, 2 mm")
    levels.widget.editingFinished.emit()
    assert "Accelerations (g): 'mm' is not a unit of this field; give g" in form.complaint


@pytest.mark.thorough
def test_the_chosen_units_are_kept_after_a_restart(context, closing, tmp_path):
    choose_units(context, closing(QWidget()), OTHERS)
    UNITS.choose({})
    again = AppContext(Settings(tmp_path / "window.ini"))
    assert tuple(UNITS.chosen_units.values()) == tuple(OTHERS.values())
    again.background.close()


@pytest.mark.thorough
def test_axis_numbers_are_in_the_unit_of_the_label(full_window):
    plot = next(each for each in full_window.pages[FILES].time_histories.plots if "m/s²" in each.up.labelText)
    usual = plot.up.tickStrings([0.0, STANDARD := 9.80665], 1.0, STANDARD)
    choose_units(full_window.context, full_window, OTHERS)
    assert plot.up.labelText == "g"
    assert plot.up.tickStrings([0.0, STANDARD], 1.0, STANDARD) == ["0", "1"] != usual


@pytest.mark.parametrize(
    ("unit", "shown", "text", "value"),
    [
        ("m", "mm", "0.045", 45e-6),
        ("m", "mm", "45 µm", 45e-6),
        ("m", "µm", "45", 45e-6),
        ("m", "m", "45e-6", 45e-6),
        ("m", "automatic", "45", 45e-6),
        ("m/s²", "g", "0.5", 0.5 * 9.80665),
        ("m/s²", "g", "3 m/s²", 3.0),
        ("m/s²", "m/s²", "1 g", 9.80665),
    ],
)
def test_a_field_accepts_its_displayed_text_and_any_stated_unit(unit, shown, text, value):
    UNITS.choose({unit: shown})
    assert parse_quantity(text, unit) == value
    assert parse_quantity(quantity_text(value, unit), unit) == pytest.approx(value, rel=1e-5)


def test_a_value_keeps_its_digits_when_it_is_shown_in_a_coarser_unit(closing):
    form = closing(ValidatedForm(HeldDwell, "dwell"))
    form.form.show_content({"base_level": {"acceleration_m_per_s2": 1.2345678901234}})
    edit = form.form.editors["base_level"].form.editors["acceleration_m_per_s2"].widget
    UNITS.choose({"m/s²": "g"})
    assert edit.lineEdit().text() == "0.125891 g"
    edit.editingFinished.emit()
    UNITS.choose({})
    assert edit.content() == 1.2345678901234


@pytest.mark.parametrize(
    ("sentence", "converted"),
    [
        ("gaps 45 and 45 µm, 12.5 to 20 µm", "gaps 0.045 and 0.045 mm, 0.0125 to 0.020 mm"),
        ("(12.3 ± 0.4) µm at 260 Hz and 5 µm", "(0.0123 ± 0.0004) mm at 260 Hz and 0.005 mm"),
        ("range 20 mm/s/V, m0 at 3 m0", "range 20 mm/s/V, m0 at 3 m0"),
        ("base 2.5 m/s2 (3 m/s² expected)", "base 0.255 g (0.306 g expected)"),
        ("dB re 1 (m/s²)²/Hz, 12 g, 3 s, 5 µs", "dB re 1 (m/s²)²/Hz, 12 g, 3 s, 5 µs"),
        ("0.25 m/s, -12 mm/s", "0.25 m/s, -0.012 m/s"),
    ],
)
def test_quantities_in_sentences_are_converted_only_to_the_chosen_units(sentence, converted):
    UNITS.choose({"m": "mm", "m/s": "m/s", "m/s²": "g"})
    assert UNITS.convert(sentence) == converted


@pytest.mark.parametrize("unit", CHOICES)
@pytest.mark.parametrize("value", [3e-7, 4.5e-5, 0.02, 1.5, 1234.0])
def test_every_unit_choice_shows_the_same_quantity(unit, value):
    for name in CHOICES[unit]:
        UNITS.choose({unit: name})
        fitted = prefixed_unit(unit, value)
        said = UNITS.convert(fitted.text(value, 6))
        assert parse_quantity(said, unit) == pytest.approx(value, rel=2e-3), name
