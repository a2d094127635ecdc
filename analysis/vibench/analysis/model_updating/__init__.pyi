from ._updated_specimen import (
    UpdatedSpecimen as UpdatedSpecimen,
    update_model as update_model,
)
