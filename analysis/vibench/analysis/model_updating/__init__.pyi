from ._parameters import (
    FittedValue as FittedValue,
    Parameter as Parameter,
)
from ._specimen_fit import (
    SpecimenFit as SpecimenFit,
    fit_specimen as fit_specimen,
)
from ._statistical_numbers import (
    statistical_numbers as statistical_numbers,
)
from ._suspects import (
    Assumption as Assumption,
    Suspect as Suspect,
)
from ._updated_specimen import (
    UpdatedSpecimen as UpdatedSpecimen,
    update_model as update_model,
)
