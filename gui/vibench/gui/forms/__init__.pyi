from ._editor import (
    Choice as Choice,
)
from ._field_edge import (
    LineField as LineField,
)
from ._model_form import (
    JudgedForm as JudgedForm,
    Loc as Loc,
    ModelForm as ModelForm,
)
from ._quantity_edit import (
    QuantityEdit as QuantityEdit,
)
