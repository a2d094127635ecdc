"""Every field of every form refuses bad values in a sentence with its name and unit."""

from pathlib import Path

import pytest
from PySide6.QtWidgets import QAbstractSpinBox, QComboBox

from vibench.acquisition.plan import EXCITATION_KINDS, Measurement, SineSweep
from vibench.analysis import AnalysisOptions
from vibench.analysis.prediction.progress import MapRequest, SimulationRequest
from vibench.gui.forms.editor import Choice
from vibench.gui.forms.model_form import GroupEditor, ValidatedForm
from vibench.gui.pages.queue.queue_page import SweepForm
from vibench.gui.pages.simulate.simulate_page import BRANCHES, CHAIN, SPECTRUM
from vibench.gui.pages.test.test_page import TestForm as FormOfATest
from vibench.gui.window.menus import Preferences

from .bad_values import BAD

SWEEP = SineSweep(amplitude_vpp=0.5, start_hz=150.0, stop_hz=300.0, duration_s=5.0)


def form_of_a_kind(kind):
    form = FormOfATest()
    form.show_value(Measurement(name="trial", excitation=SWEEP))
    form.form.editors["excitation"].kind_choice.setCurrentText(kind.replace("_", " "))
    assert form.form.editors["excitation"].form.model is EXCITATION_KINDS[kind].plan
    return form


def settings():
    form = ValidatedForm(Preferences, "settings")
    form.form.show_content({"font_pt": 9, "patience_s": 2.0, "recordings_folder": str(Path.home())})
    return form


FORMS = {
    **{f"test {kind}": lambda kind=kind: form_of_a_kind(kind) for kind in EXCITATION_KINDS},
    "analysis": lambda: ValidatedForm(AnalysisOptions, "analysis"),
    "map": lambda: ValidatedForm(MapRequest, "map", frozenset({"described"})),
    "settings": settings,
    "simulation": lambda: ValidatedForm(SimulationRequest, "simulation", frozenset({"described"})),
    **{
        kind.name: lambda kind=kind: ValidatedForm(kind.request, kind.name, kind.hidden)
        for kind in (BRANCHES, SPECTRUM, CHAIN)
    },
}


def rows(form):
    for name, row in form._rows.items():
        if isinstance(row.editor, GroupEditor):
            yield from rows(row.editor.form)
        else:
            yield name, row


def type_into(widget, text):
    line = widget.lineEdit() if isinstance(widget, QAbstractSpinBox | QComboBox) else widget
    line.setText(text)
    (widget if isinstance(widget, QAbstractSpinBox) else line).editingFinished.emit()


@pytest.mark.thorough
@pytest.mark.parametrize("name", FORMS)
def test_the_error_for_a_bad_value_names_the_field_and_the_unit(closing, name):
    form = closing(FORMS[name]())
    assert form.value is not None, form.complaint  # a newly chosen kind begins with valid values
    asked = 0
    for field, row in rows(form.form):
        widget = row.editor.widget
        if isinstance(widget, Choice) and not widget.isEditable():
            continue
        before = row.editor.content()
        for bad in BAD:
            type_into(widget, bad)
            asked += 1
            if form.value is None:
                assert row.facts.label_with_unit in form.complaint, (field, bad, form.complaint)
                assert len(form.complaint) < 1500
        row.editor.show_content(before)
        form.form.changed.emit()
        assert form.value is not None, (field, form.complaint)
    assert asked >= len(BAD)


def test_a_bad_value_in_a_sweep_is_refused_with_the_name_and_the_unit_of_its_field(closing):
    form = closing(SweepForm())
    refused, wanted = [], []
    form.refused.connect(refused.append)
    form.wanted.connect(lambda *given: wanted.append(given))
    for label, edit in (("From (Vpp)", form.start), ("To (Vpp)", form.stop), ("Points", form.count)):
        good = edit.content()
        for bad in BAD:
            refused.clear()
            wanted.clear()
            type_into(edit, bad)
            form._add()
            assert wanted or label in refused[0] or "Range" in refused[0], (bad, refused)
            assert wanted == [] or edit.complaint == ""
        edit.show_content(good)
