"""Every value of every plan has a field, and the form returns it unchanged."""

from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel

from vibench.acquisition import load_campaign
from vibench.acquisition.plan import EXCITATION_KINDS, Measurement
from vibench.analysis.dynamics import SpecimenChoice
from vibench.gui.forms.model_form import ModelForm, ValidatedForm

CAMPAIGNS = Path(__file__).resolve().parents[3] / "campaigns"
MEASUREMENTS = {
    f"{path.stem}-{each.name}": each
    for path in sorted(CAMPAIGNS.glob("*.toml"))
    for each in load_campaign(path).measurements
}


@pytest.fixture
def form(closing):
    return closing(ModelForm(Measurement))


@pytest.mark.parametrize("name", MEASUREMENTS)
def test_the_form_returns_an_unedited_measurement_unchanged(form, name):
    measurement = MEASUREMENTS[name]
    form.show_content(measurement.model_dump(mode="json", exclude_none=True))
    assert Measurement.model_validate(form.content()) == measurement


def leaves(form):
    """Every field of a form, including fields of nested models."""
    for name, editor in form.editors.items():
        inner = getattr(editor, "form", None)
        if inner is None:
            yield name, editor.widget
        else:
            yield from leaves(inner)


@pytest.mark.parametrize("kind", sorted(EXCITATION_KINDS))
def test_every_field_of_every_kind_has_a_name_and_a_label(form, kind):
    example = next((m for m in MEASUREMENTS.values() if m.excitation.kind == kind), None)
    excitation = form.editors["excitation"]
    excitation.show_content({"kind": kind} if example is None else example.excitation)
    model = excitation.form.model
    assert model.model_fields["kind"].default == kind
    assert set(excitation.form.editors) == set(model.model_fields) - {"kind"}
    buddies = {label.buddy() for label in form.findChildren(QLabel) if label.buddy() is not None}
    for name, widget in leaves(form):
        assert widget.accessibleName(), name
        assert widget in buddies, name


def test_fields_show_units_and_limits(form):
    widget = form.editors["ramp_s"].widget
    assert widget.accessibleName() == "Ramp in s"
    assert "above 0, at most 60 s" in widget.toolTip()
    form.show_content({"ramp_s": 1.5})
    assert widget.text() == "1.5 s"


def test_typed_values_reach_the_plan(form, qtbot):
    form.show_content(MEASUREMENTS["quick-dwell"].model_dump(mode="json"))
    widget = form.editors["excitation"].form.editors["frequency_hz"].widget
    widget.lineEdit().setText("0,3 kHz")
    qtbot.keyClick(widget, Qt.Key.Key_Return)
    assert form.content()["excitation"]["frequency_hz"] == 300.0


def test_non_numeric_text_shows_an_error_at_its_field_and_keeps_the_plan(form, qtbot):
    form.show_content(MEASUREMENTS["quick-dwell"].model_dump(mode="json"))
    editor = form.editors["ramp_s"]
    editor.widget.lineEdit().setText("soon")
    qtbot.keyClick(editor.widget, Qt.Key.Key_Return)
    form.complain({})
    assert "'soon' is not a number" in editor.complaint
    assert form.content()["ramp_s"] == MEASUREMENTS["quick-dwell"].ramp_s


def test_invalid_text_in_a_group_that_is_switched_off_does_not_block_the_plan(qtbot, closing):
    form = closing(ValidatedForm(Measurement, "test"))
    form.show_value(next(iter(MEASUREMENTS.values())))
    until = form.form.editors["until"]
    until.show_content({})
    widget = until.form.editors["response_i"].widget
    widget.lineEdit().setText("rigid:2")
    qtbot.keyClick(widget, Qt.Key.Key_Return)
    assert form.value is None
    assert "'rigid:2' is not a number" in form.complaint
    until.show_content(None)
    assert form.value is not None
    assert form.complaint == ""


def test_changing_the_kind_keeps_shared_values(form):
    form.show_content(MEASUREMENTS["quick-dwell"].model_dump(mode="json"))
    excitation = form.editors["excitation"]
    excitation.kind_choice.setCurrentIndex(excitation.kind_choice.findText("sine sweep"))
    content = excitation.content()
    assert content["kind"] == "sine_sweep"
    assert content["amplitude_vpp"] == MEASUREMENTS["quick-dwell"].excitation.amplitude_vpp


def test_the_help_of_a_field_is_its_description_in_the_model(form):
    form.show_content(MEASUREMENTS["quick-dwell"].model_dump(mode="json"))
    excitation = form.editors["excitation"].form
    assert (
        "Amplitude setting as shown on the generator's panel"
        in excitation.editors["amplitude_vpp"].widget.toolTip()
    )


def test_the_form_warns_when_spring_constants_belong_to_another_mass(closing, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('name = "mine"\nmodel = "gong2025"\nmasses_kg = [5.8e-3, 3.2e-3, 2e-3]\n')
    form = closing(ValidatedForm(SpecimenChoice, "scene", frozenset({"described"})))
    form.form.show_content({"specimen": str(path)})
    assert form.value is not None
    assert "single_frequencies_hz was kept; give stiffnesses_n_per_m = [" in form.warning.text()
    form.form.show_content({"specimen": "heavy"})
    assert form.warning.text() == ""
