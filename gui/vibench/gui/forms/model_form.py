"""A form for a plan model: one row per field, groups for inner models, validated at every change."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import QCheckBox, QFormLayout, QGroupBox, QLabel, QVBoxLayout, QWidget

from vibench.sim import SpecimenWarning

from ..widgets.boxes import fill_box
from ..widgets.units import CHOICES, UNITS, SentenceLabel
from .editor import Choice, ChoiceEditor, Editor, FieldFacts, field_facts, unwrap_optional, value_editor

Loc = tuple[int | str, ...]


@dataclass(eq=False)
class _Row:
    facts: FieldFacts
    editor: Editor
    complaint: QLabel
    label: QLabel | None

    def explain(self) -> None:
        """Show label, limits and explanation in the chosen units."""
        for each in (self.editor.widget, self.label):
            if each is not None:
                each.setToolTip(self.facts.tooltip)
        self.editor.widget.setAccessibleName(self.facts.accessible_name)
        self.editor.widget.setAccessibleDescription(self.facts.tooltip)


def complaints_of(error: ValidationError) -> dict[Loc, str]:
    """Return the model's error messages, keyed by field, without consequences of other errors."""
    return {
        detail["loc"]: detail["msg"].removeprefix("Value error, ")
        for detail in error.errors()
        if detail["type"] != "default_factory_not_called"
    }


class ModelForm(QWidget):
    """Form of a plan; its content has the types of a plan file and is validated by the plan's model."""

    changed = Signal()

    def __init__(self, model: type[BaseModel], hidden: frozenset[str] = frozenset()) -> None:
        super().__init__()
        self.model = model
        self._fixed: dict[str, Any] = {}
        self._rows: dict[str, _Row] = {}
        self.edited = ""
        """Label and unit of the field changed last."""
        self._layout = QFormLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setRowWrapPolicy(QFormLayout.RowWrapPolicy.DontWrapRows)
        self._layout.setFieldGrowthPolicy(QFormLayout.FieldGrowthPolicy.AllNonFixedFieldsGrow)
        for name, field in model.model_fields.items():
            if name in hidden:
                continue
            plain, _ = unwrap_optional(field.annotation)
            if get_origin(plain) is Literal and (name == "kind" or len(get_args(plain)) == 1):
                self._fixed[name] = get_args(plain)[0]
            else:
                self._add(name, field)
        UNITS.on_change(self._explain)

    @property
    def editors(self) -> dict[str, Editor]:
        """Editors of the form, by field name."""
        return {name: row.editor for name, row in self._rows.items()}

    def content(self) -> dict[str, Any]:
        """Return the content as in a file; leave out empty fields whose default is also empty."""
        given = {name: row.editor.content() for name, row in self._rows.items()}
        values = {
            name: value
            for name, value in given.items()
            if value is not None or _may_be_emptied(self.model.model_fields[name])
        }
        return {**self._fixed, **values}

    def show_content(self, content: Mapping[str, Any]) -> None:
        """Show content from a file; a field without content shows the default."""
        with QSignalBlocker(self):
            for name, row in self._rows.items():
                row.editor.show_content(content.get(name, _default(self.model.model_fields[name])))
        self.edited = ""
        self.changed.emit()

    def complain(self, complaints: Mapping[Loc, str]) -> tuple[str, ...]:
        """Show errors at their fields, including fields of inner models; return all errors with field names.

        An error that concerns several fields together is shown with the name of the field changed last.
        """
        sentences: list[str] = []
        for name, row in self._rows.items():
            inner = {
                _after_kind(row.editor, loc[1:]): text
                for loc, text in complaints.items()
                if loc and loc[0] == name
            }
            if isinstance(row.editor, GroupEditor):
                found = row.editor.complain(inner)
                sentences += found if inner or row.editor.complaint else ()
                continue
            text = row.editor.complaint or "; ".join(inner.values())
            text = f"{row.facts.label_with_unit}: {_sentence(text, row.facts)}" if text else ""
            row.complaint.setText(text)
            row.complaint.setVisible(bool(text))
            sentences += [text] if text else []
        placed = {*self._rows}
        about = f"{self.edited}: " if self.edited else ""
        sentences += [about + text for loc, text in complaints.items() if not loc or loc[0] not in placed]
        return tuple(sentences)

    @property
    def is_read(self) -> bool:
        """Whether all texts typed into this form and its inner forms can be read."""
        return not any(editor.complaint for editor in self.editors.values())

    def _add(self, name: str, field: FieldInfo) -> None:
        facts = field_facts(self.model, name, field)
        editor = editor_for(field, facts, lambda *_: self._note_edit(name))
        complaint = SentenceLabel(rank="complaint")
        complaint.hide()
        complaint.setAccessibleName(f"Error message for {facts.label}")
        widget = editor.widget
        label = None if isinstance(editor, GroupEditor) else QLabel(facts.label)
        if label is None:
            self._layout.addRow(widget)
        else:
            label.setBuddy(widget)
            self._layout.addRow(label, widget)
        self._layout.addRow(complaint)
        self._rows[name] = _Row(facts, editor, complaint, label)
        self._rows[name].explain()

    def _explain(self) -> None:
        """Show values and explanations in the chosen units; text that cannot be read stays as it is."""
        for row in self._rows.values():
            row.explain()
            if row.facts.unit in CHOICES and not row.editor.complaint:
                row.editor.show_content(row.editor.content())

    def _note_edit(self, name: str) -> None:
        row = self._rows.get(name)
        if row is not None:
            inside = row.editor.form.edited if isinstance(row.editor, GroupEditor) else ""
            self.edited = inside or row.facts.label_with_unit
            self.changed.emit()


class GroupEditor:
    """Editor of an inner model; the user chooses its kind if there are several."""

    def __init__(
        self, facts: FieldFacts, kinds: tuple[type[BaseModel], ...], changed: Callable[..., None]
    ) -> None:
        self.widget = QGroupBox(facts.label)
        self._changed = changed
        self._layout = QVBoxLayout(self.widget)
        self._kinds = kinds
        self._kind: ChoiceEditor | None = None
        self._memory: dict[str, Any] = {}
        self._memories: dict[str, dict[str, Any]] = {}
        """Last content of each kind, which is shown when the user chooses that kind again."""
        self._usual: Mapping[str, Any] = {}
        self._fresh: Mapping[str, Mapping[str, Any]] = {}
        if len(kinds) > 1:
            self._kind = ChoiceEditor(tuple(_kind_of(kind) for kind in kinds), self._turn)
            self._kind.widget.setAccessibleName(f"Kind of {facts.label.lower()}")
            self._kind.widget.setToolTip(f"Choose the kind of {facts.label.lower()}")
            self._layout.addWidget(self._kind.widget)
        self.form = self._new_form(kinds[0])

    @property
    def kind_choice(self) -> Choice | None:
        """Combo box in which the user chooses the kind; None if there is only one kind."""
        return None if self._kind is None else self._kind.widget

    @property
    def complaint(self) -> str:
        """First error in a field of the inner form; empty if all fields can be read."""
        return next(filter(None, (editor.complaint for editor in self.form.editors.values())), "")

    def content(self) -> Any:
        """Return the content as stored in a file."""
        return self.form.content()

    def show_content(self, content: Any) -> None:
        """Show content from a file, in the form of its kind."""
        values = _as_content(content) or {}
        if self._kind is not None and "kind" in values:
            self._kind.show_content(values["kind"])
        self.form.show_content(values)

    def complain(self, complaints: Mapping[Loc, str]) -> tuple[str, ...]:
        """Show errors at the fields of the inner form."""
        return self.form.complain(complaints)

    def set_starting_values(
        self,
        usual: Mapping[str, Any],
        fresh: Mapping[str, Mapping[str, Any]],
        lines: Mapping[str, tuple[str, str]],
    ) -> None:
        """Set the initial values for newly chosen kinds, and describe the kinds in the list.

        ``usual`` fills empty fields of every kind. ``fresh`` has values by kind, which replace values typed
        for another kind. ``lines`` has the heading and the description of each kind.

        """
        self._usual, self._fresh = usual, fresh
        assert self._kind is not None
        self._kind.explain(lines)

    def _turn(self, *_: object) -> None:
        """Change to the chosen kind; fields of the same name keep their values."""
        assert self._kind is not None
        left, chosen = self.form.content(), self._kind.content()
        if chosen is None:  # the user chose a heading of the list
            self._kind.show_content(left["kind"])
            return
        self._memories[left["kind"]] = left
        known_of = self._memories.get(chosen, self._fresh.get(chosen, {}))
        self._memory = {**self._usual, **self._memory, **left}
        model = next(kind for kind in self._kinds if _kind_of(kind) == chosen)
        self._layout.removeWidget(self.form)
        self.form.hide()
        self.form.deleteLater()
        self.form = self._new_form(model)
        values = {**self._memory, **known_of}
        known = {name: value for name, value in values.items() if name in model.model_fields}
        self.form.show_content({name: value for name, value in known.items() if name not in _DRAWN})
        self._changed()

    def _new_form(self, model: type[BaseModel]) -> ModelForm:
        form = ModelForm(model)
        form.changed.connect(self._changed)
        self._layout.addWidget(form)
        return form


class OptionalGroupEditor(GroupEditor):
    """Editor of an inner model that may be absent; a check box switches it on."""

    def __init__(
        self, facts: FieldFacts, kinds: tuple[type[BaseModel], ...], changed: Callable[..., None]
    ) -> None:
        super().__init__(facts, kinds, changed)
        self._there = QCheckBox(f"Give {facts.label.lower()}")
        self._there.setAccessibleName(f"Give {facts.label.lower()}")
        self._there.setToolTip(facts.tooltip)
        # Align the check box left with its natural width, because the form may be wider than a small window.
        self._layout.insertWidget(0, self._there, alignment=Qt.AlignmentFlag.AlignLeft)
        self._there.toggled.connect(self.form.setVisible)
        self._there.toggled.connect(lambda _there: changed())
        self.form.hide()

    @property
    def complaint(self) -> str:
        """First error in a field of the inner model; empty if the model is absent."""
        return super().complaint if self._there.isChecked() else ""

    def content(self) -> Any:
        """Return the content as stored in a file; None if the model is absent."""
        return super().content() if self._there.isChecked() else None

    def show_content(self, content: Any) -> None:
        """Show content from a file; None clears the check box."""
        self._there.setChecked(content is not None)
        if content is not None:
            super().show_content(content)


_DRAWN = frozenset({"excited_lines", "detection_lines"})
"""Fields that a plan fills with random numbers; changing the kind of excitation drops their values."""


def editor_for(field: FieldInfo, facts: FieldFacts, changed: Callable[..., None]) -> Editor:
    """Return the editor of a field; the field may be an inner model."""
    plain, may_be_missing = unwrap_optional(field.annotation)
    kinds = tuple(unwrap_optional(part)[0] for part in get_args(plain)) or (plain,)
    if all(isinstance(kind, type) and issubclass(kind, BaseModel) for kind in kinds):
        make = OptionalGroupEditor if may_be_missing else GroupEditor
        return make(facts, kinds, changed)
    return value_editor(field.annotation, facts, changed)


def _kind_of(model: type[BaseModel]) -> str:
    return str(model.model_fields["kind"].default)


def _may_be_emptied(field: FieldInfo) -> bool:
    """Return whether a field may be left empty and then means something other than its default."""
    return unwrap_optional(field.annotation)[1] and not field.is_required() and _default(field) is not None


def _default(field: FieldInfo) -> Any:
    if field.is_required():
        return None
    return _as_content(field.get_default(call_default_factory=True, validated_data={}))


def _as_content(value: Any) -> Any:
    return value.model_dump(mode="json", exclude_none=True) if isinstance(value, BaseModel) else value


def _after_kind(editor: Editor, loc: Loc) -> Loc:
    """Remove the kind from the location of an error: pydantic includes the kind, the form does not."""
    if isinstance(editor, GroupEditor) and editor.kind_choice is not None and loc:
        return loc[1:]
    return loc


def _sentence(text: str, facts: FieldFacts) -> str:
    """Return an error of the model in words for the form."""
    unit = f" in {facts.shown_unit}" if facts.unit else ""
    if text == "Field required":
        return f"the field is empty; type a value{unit}"
    allowed = f"; allowed is {facts.limits}" if facts.limits else unit and f"; give it{unit}"
    return text.replace("Input should be", "must be") + (allowed if text.startswith("Input should") else "")


Model = TypeVar("Model", bound=BaseModel)


class ValidatedForm(QWidget, Generic[Model]):
    """Form of a model, with the model's errors and warnings below the fields."""

    changed = Signal()

    def __init__(
        self,
        model: type[Model],
        name: str,
        hidden: frozenset[str] = frozenset(),
    ) -> None:
        super().__init__()
        self._model = model
        self.value: Model | None = None
        """The validated model; None if the content is not allowed."""
        self.form = ModelForm(model, hidden)
        self._complaint = SentenceLabel(rank="complaint", name=f"Error message for the {name}")
        self.warning = SentenceLabel(name=f"Warning about the {name}")
        """Warnings about allowed values that may be mistakes, such as springs derived from another mass."""
        fill_box(QVBoxLayout(self), self.form, self._complaint, self.warning, margin=0)
        self.form.changed.connect(self._take)
        UNITS.on_change(self._validate)
        self.form.show_content({})

    @property
    def complaint(self) -> str:
        """All errors in the content, as one text."""
        return self._complaint.text()

    def show_value(self, value: Model) -> None:
        """Replace the displayed value."""
        self.form.show_content(value.model_dump(mode="json"))

    def _take(self) -> None:
        self._validate()
        self.changed.emit()

    def _validate(self) -> None:
        complaints: dict[Loc, str] = {}
        self.value = None
        with warnings.catch_warnings(record=True, action="always", category=SpecimenWarning) as warned:
            try:
                value = self._model.model_validate(self.form.content())
            except ValidationError as error:
                complaints = complaints_of(error)
            else:
                self.value = value if self.form.is_read else None
        self.warning.setText("; ".join(f"⚠ {each.message}" for each in warned))
        self.warning.setVisible(bool(warned))
        self._complaint.setText("; ".join(self.form.complain(complaints)))
        self._complaint.setVisible(bool(self._complaint.text()))
