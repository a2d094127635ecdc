"""A form whose content the model itself judges at every change, field by field and as a whole."""

from typing import Generic, TypeVar

from pydantic import BaseModel, ValidationError
from PySide6.QtCore import Signal
from PySide6.QtWidgets import QLabel, QVBoxLayout, QWidget

from ._model_form import Loc, ModelForm

Model = TypeVar("Model", bound=BaseModel)


class JudgedForm(QWidget, Generic[Model]):
    """Fields, and below them what does not fit together."""

    changed = Signal()

    def __init__(self, model: type[Model], name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._model = model
        self._value: Model | None = None
        self.form = ModelForm(model)
        self._complaint = QLabel()
        self._complaint.setProperty("rank", "complaint")
        self._complaint.setWordWrap(True)
        self._complaint.setAccessibleName(f"Complaint about the {name}")
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self.form)
        layout.addWidget(self._complaint)
        self.form.changed.connect(self._judge)
        self.form.show_content({})

    @property
    def value(self) -> Model | None:
        """What the form says; None while that is not allowed."""
        return self._value

    @property
    def complaint(self) -> str:
        """What is not allowed, all of it."""
        return self._complaint.text()

    def show_value(self, value: Model) -> None:
        """Show other content."""
        self.form.show_content(value.model_dump(mode="json", exclude_none=True))

    def _judge(self) -> None:
        complaints: dict[Loc, str] = {}
        self._value = None
        try:
            value = self._model.model_validate(self.form.content())
        except ValidationError as error:
            complaints = {
                detail["loc"]: detail["msg"].removeprefix("Value error, ") for detail in error.errors()
            }
        else:
            self._value = None if self.form.unread else value
        self.form.complain(complaints)
        self._complaint.setText("; ".join(text for loc, text in complaints.items() if not loc))
        self._complaint.setVisible(bool(self._complaint.text()))
        self.changed.emit()
