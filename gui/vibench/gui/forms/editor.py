"""One editor for each type of value in a plan, with the facts about a field that the form shows."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Protocol, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QSignalBlocker, Qt
from PySide6.QtGui import QKeyEvent, QStandardItemModel
from PySide6.QtWidgets import QComboBox, QStyledItemDelegate, QStyleOptionViewItem, QWidget

from vibench.acquisition import ChosenFrom, ConfigurationError
from vibench.analysis.prediction.field_docstrings import field_docstring

from ..widgets.units import CHOICES, UNITS
from .quantity_edit import EdgedField, LineField, QuantityEdit, parse_quantity, quantity_text, unit_of

_ENDINGS = (
    ("_m_per_s2", "m/s²"),
    ("_m_per_s", "m/s"),
    ("_per_s", "1/s"),
    ("_vpp", "Vpp"),
    ("_pt", "pt"),
    ("_hz", "Hz"),
    ("_db", "dB"),
    ("_deg", "°"),
    ("_s", "s"),
    ("_m", "m"),
    ("_v", "V"),
    ("_a", "A"),
    ("_n", "N"),
)
"""Endings of field names, longest first, with their units."""


@dataclass(frozen=True)
class FieldFacts:
    """Description of a field for the form."""

    name: str
    label: str
    unit: str
    """Unit in the plan: an SI unit, or another unit such as dB."""
    allowed: str
    """Allowed range, such as ``"above 0, at most 60 s"``; empty if there are no limits."""
    explanation: str
    examples: tuple[str, ...] = ()
    """Suggested texts; the user may also type other texts."""

    @property
    def shown_unit(self) -> str:
        """Unit in which a number without a unit is read."""
        return UNITS.in_field(self.unit)

    @property
    def limits(self) -> str:
        """Allowed range of the field, in the chosen units."""
        return UNITS.convert(self.allowed)

    @property
    def tooltip(self) -> str:
        """Explanation of the field, followed by its limits."""
        limits = f"Allowed: {self.limits}" if self.limits else ""
        return "\n".join(part for part in (UNITS.convert(self.explanation), limits) if part)

    @property
    def label_with_unit(self) -> str:
        """Label with unit; error messages about the field begin with it."""
        return f"{self.label} ({self.shown_unit})" if self.unit else self.label

    @property
    def accessible_name(self) -> str:
        """Name of the field for screen readers."""
        return f"{self.label} in {self.shown_unit}" if self.unit else self.label


def field_facts(model: type[BaseModel], name: str, field: FieldInfo) -> FieldFacts:
    """Return the form's description of a field of a model."""
    suffix, unit = next(((s, u) for s, u in _ENDINGS if name.endswith(s)), ("", ""))
    words = name.removesuffix(suffix).replace("_", " ")
    return FieldFacts(
        name=name,
        label=words[:1].upper() + words[1:],
        unit=unit,
        allowed=_limits(field, unit),
        explanation=field_docstring(model, name),
        examples=tuple(
            each for mark in field.metadata if isinstance(mark, ChosenFrom) for each in mark.texts()
        ),
    )


def _limits(field: FieldInfo, unit: str) -> str:
    """Return the limits as text; a selectable unit follows each number, other units only the last."""
    each = f" {unit}" if unit in CHOICES else ""
    texts = ", ".join(_limit_texts(field, each))
    return texts if each or not texts else f"{texts} {unit}".strip()


def _limit_texts(field: FieldInfo, unit: str) -> Iterator[str]:
    constraints = (*field.metadata, *_inner(field.annotation))
    # State lower bounds before upper bounds.
    for constraint in sorted(constraints, key=lambda each: isinstance(each, (Le, Lt))):
        match constraint:
            case Ge(ge):
                yield f"at least {ge:g}{unit}"
            case Gt(gt):
                yield f"above {gt:g}{unit}"
            case Le(le):
                yield f"at most {le:g}{unit}"
            case Lt(lt):
                yield f"below {lt:g}{unit}"


def _inner(annotation: Any) -> Iterator[object]:
    """Yield the constraints on the elements of a tuple, or on an optional value."""
    for part in get_args(annotation):
        yield from getattr(part, "__metadata__", ())
        yield from _inner(part)


class Editor(Protocol):
    """Widget that edits one value of a plan; the value has the same type as in a plan file."""

    @property
    def widget(self) -> QWidget:
        """Widget with which the user edits the value in the form."""

    @property
    def complaint(self) -> str:
        """Reason why the typed text cannot be read; empty if the text can be read."""

    def content(self) -> Any:
        """Return the value as stored in a plan file; None for an empty field."""

    def show_content(self, content: Any) -> None:
        """Show a value as read from a plan file; None for an empty field."""


_LEFT_OPEN = "default"
"""Placeholder of an empty optional field."""


class Choice(EdgedField, QComboBox):
    """Combo box that ignores the space bar and, unless it has the focus, the mouse wheel.

    The space bar freezes the plots of the Run page. F4 and Alt+Down open the list. The width does not depend
    on the longest entry.
    """

    LETTERS = 10

    def __init__(self, name: str = "", tip: str = "", items: Iterable[str] = ()) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.setToolTip(tip)
        self.addItems(list(items))
        self.setSizeAdjustPolicy(Choice.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        self.setMinimumContentsLength(self.LETTERS)

    def replace_items(self, items: Iterable[str], chosen: str = "") -> None:
        """Replace the entries and choose one, by default the first, without emitting a signal."""
        with QSignalBlocker(self):
            self.clear()
            self.addItems(list(items))
            self.setCurrentIndex(max(0, self.findText(chosen)))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Pass the space bar on to the page."""
        if event.key() == Qt.Key.Key_Space:
            event.ignore()
        else:
            super().keyPressEvent(event)


class _LineOnEach(QStyledItemDelegate):
    """Delegate that shows a description beside each entry of an open list."""

    def initStyleOption(
        self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        """Add the description to the data for drawing the entry."""
        super().initStyleOption(option, index)
        line = index.data(Qt.ItemDataRole.ToolTipRole)
        option.text = f"    {option.text}:  {line}" if line else option.text


class ChoiceEditor:
    """Editor of a choice from given values, which need no validation."""

    complaint = ""

    def __init__(self, values: tuple[Any, ...], changed: Callable[..., None]) -> None:
        self.widget = Choice()
        self.widget.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        for value in values:
            self.widget.addItem(str(value).replace("_", " "), value)
        self.widget.currentIndexChanged.connect(changed)

    def content(self) -> Any:
        """Return the value chosen in the list."""
        return self.widget.currentData()

    def show_content(self, content: Any) -> None:
        """Choose a value in the list."""
        place = self.widget.findData(content)
        if place >= 0 and content is not None:
            self.widget.setCurrentIndex(place)

    def explain(self, lines: Mapping[str, tuple[str, str]]) -> None:
        """Group the choices under headings; ``lines`` has the heading and description of each choice."""
        blocked, chosen = self.widget.blockSignals(True), self.content()
        self.widget.clear()
        model = self.widget.model()
        assert isinstance(model, QStandardItemModel)
        for heading in dict.fromkeys(heading for heading, _ in lines.values()):
            self.widget.addItem(heading.upper())
            model.item(model.rowCount() - 1).setEnabled(False)
            for value, (_, line) in (each for each in lines.items() if each[1][0] == heading):
                self.widget.addItem(value.replace("_", " "), value)
                self.widget.setItemData(self.widget.count() - 1, line, Qt.ItemDataRole.ToolTipRole)
        view = self.widget.view()
        view.setItemDelegate(_LineOnEach(self.widget))
        view.setMinimumWidth(view.sizeHintForColumn(0) + view.verticalScrollBar().sizeHint().width())
        self.show_content(chosen)
        self.widget.blockSignals(blocked)


class TextEditor:
    """Editor of a text; the plan's model validates it."""

    complaint = ""

    def __init__(self, changed: Callable[..., None]) -> None:
        self.widget = LineField()
        self.widget.editingFinished.connect(changed)

    def content(self) -> str:
        """Return the typed text."""
        return self.widget.text()

    def show_content(self, content: Any) -> None:
        """Show a text in the field."""
        self.widget.setText("" if content is None else str(content))


class SuggestionEditor:
    """Editor of a text that is chosen from a list or typed; the plan's model validates it."""

    complaint = ""

    def __init__(self, examples: tuple[str, ...], changed: Callable[..., None]) -> None:
        self.widget = Choice()
        self.widget.setEditable(True)
        self.widget.setInsertPolicy(Choice.InsertPolicy.NoInsert)
        self.widget.addItems(examples)
        self._shown = self.widget.currentText()
        self._changed = changed
        self.widget.activated.connect(self._note_text)
        line = self.widget.lineEdit()
        if line is not None:
            line.setPlaceholderText(_LEFT_OPEN)
            line.editingFinished.connect(self._note_text)

    def content(self) -> str:
        """Return the chosen or typed text."""
        return self.widget.currentText()

    def show_content(self, content: Any) -> None:
        """Show a text in the field."""
        self._shown = "" if content is None else str(content)
        self.widget.setCurrentText(self._shown)

    def _note_text(self, *_: object) -> None:
        if self.widget.currentText() != self._shown:
            self._shown = self.widget.currentText()
            self._changed()


class ListEditor:
    """Editor of a list of values, typed in one line: ``95, 266, 500``.

    If the user can choose the unit, each number is read as in a quantity field.
    """

    def __init__(self, unit: str, changed: Callable[..., None]) -> None:
        self._unit = unit if unit in CHOICES else ""
        self.widget = LineField()
        self.widget.setPlaceholderText("none, or a list such as 95, 266, 500")
        self.widget.editingFinished.connect(changed)
        self._complaint = ""
        self._shown: tuple[str, list[Any]] = ("", [])
        """Last text shown in the field, and its numbers in full precision."""

    @property
    def complaint(self) -> str:
        """Reason why the typed text is not a list of numbers; empty if it is such a list."""
        self.content()
        return self._complaint

    def content(self) -> Any:
        """Return the numbers of the typed list."""
        self._complaint, text = "", self.widget.text()
        if text == self._shown[0]:
            return self._shown[1]
        try:
            if self._unit:
                shown = self._shown[0].split(",")
                return [
                    parse_quantity(each, self._unit, unit_of(shown[min(place, len(shown) - 1)], self._unit))
                    for place, each in enumerate(text.split(","))
                    if text.strip()
                ]
            return json.loads(f"[{text}]")
        except json.JSONDecodeError as error:
            self._complaint = f"{text!r} is not a list ({error.msg}); write a list such as 95, 266, 500"
        except ConfigurationError as error:
            self._complaint = str(error)
        return []

    def show_content(self, content: Any) -> None:
        """Show a list of numbers in the field."""
        values = list(content or ())
        texts = (quantity_text(each, self._unit) for each in values)
        text = ", ".join(texts) if self._unit else json.dumps(values)[1:-1]
        self._shown = (text, values)
        self.widget.setText(text)


def unwrap_optional(annotation: Any) -> tuple[Any, bool]:
    """Return a field's type without ``Annotated`` and ``| None``, and whether the field allows None."""
    while get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) in (Union, UnionType):
        parts = [part for part in get_args(annotation) if part is not NoneType]
        if len(parts) == 1 and len(parts) < len(get_args(annotation)):
            return unwrap_optional(parts[0])[0], True
    return annotation, False


def value_editor(annotation: Any, facts: FieldFacts, changed: Callable[..., None]) -> Editor:
    """Return the editor for a plain value."""
    plain, may_be_missing = unwrap_optional(annotation)
    if plain in (float, int):
        edit = QuantityEdit(facts.unit, plain, _LEFT_OPEN if may_be_missing else "")
        edit.changed.connect(changed)
        return edit
    if get_origin(plain) is Literal:
        return ChoiceEditor(get_args(plain), changed)
    if isinstance(plain, type) and issubclass(plain, Enum):
        return ChoiceEditor(tuple(member.value for member in plain), changed)
    if get_origin(plain) in (tuple, list):
        return ListEditor(facts.unit, changed)
    if plain is str:
        return SuggestionEditor(facts.examples, changed) if facts.examples else TextEditor(changed)
    raise TypeError(f"{facts.name} has the type {annotation}, for which there is no editor; add an editor")
