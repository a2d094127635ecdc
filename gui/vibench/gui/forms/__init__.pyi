from ._editor import (
    Choice as Choice,
)
from ._field_edge import (
    LineField as LineField,
)
from ._model_form import (
    GroupEditor as GroupEditor,
    JudgedForm as JudgedForm,
    ModelForm as ModelForm,
    complaints_of as complaints_of,
)
from ._quantity_edit import (
    QuantityEdit as QuantityEdit,
)
