from ._accuracy import (
    Accuracy as Accuracy,
    AccuracyWord as AccuracyWord,
)
from ._against_stops import (
    BaseResponse as BaseResponse,
    base_response as base_response,
)
from ._bound_modes import (
    PULL as PULL,
    RATE as RATE,
    ROW as ROW,
    SHAPE as SHAPE,
    bound_motion as bound_motion,
)
from ._contact_law import (
    CONTACT_LAWS as CONTACT_LAWS,
    ContactLaw as ContactLaw,
    model_named as model_named,
)
from ._drive import (
    Drive as Drive,
    Harmonic as Harmonic,
    LinearSweep as LinearSweep,
    LogarithmicSweep as LogarithmicSweep,
    Sampled as Sampled,
    Sweep as Sweep,
)
from ._elasticity import (
    Elasticity as Elasticity,
    hertz_stiffness as hertz_stiffness,
)
from ._frozen_model import (
    FrozenModel as FrozenModel,
)
from ._hertz import (
    Hertz as Hertz,
)
from ._hunt_crossley import (
    HuntCrossley as HuntCrossley,
)
from ._linear_gap import (
    LinearGap as LinearGap,
)
from ._modes import (
    ModalForm as ModalForm,
    base_transmissibility as base_transmissibility,
    diagonal_form as diagonal_form,
    harmonic_motion as harmonic_motion,
    modal_form as modal_form,
    state_matrix as state_matrix,
)
from ._no_contact import (
    NoContact as NoContact,
)
from ._outcome import (
    Outcome as Outcome,
)
from ._power_law import (
    MOST_TERMS as MOST_TERMS,
    PowerLaw as PowerLaw,
)
from ._rigid_stops import (
    RigidStops as RigidStops,
)
from ._specimen import (
    Matrix as Matrix,
    Specimen as Specimen,
    Triple as Triple,
    bound_matrices as bound_matrices,
    gong2025 as gong2025,
)
from ._specimen_description import (
    USUAL_SPECIMEN as USUAL_SPECIMEN,
    ContactWord as ContactWord,
    DampingTime as DampingTime,
    SpecimenDescription as SpecimenDescription,
    SpecimenTable as SpecimenTable,
    SpecimenWarning as SpecimenWarning,
    UnknownSpecimenError as UnknownSpecimenError,
    load_specimen as load_specimen,
    shipped_specimens as shipped_specimens,
    usual_specimen as usual_specimen,
)
from ._state import (
    VX as VX,
    VY as VY,
    VZ as VZ,
    X as X,
    Y as Y,
    Z as Z,
)
from ._toml_table import (
    UnreadableTomlError as UnreadableTomlError,
    fault_in_words as fault_in_words,
    toml_table as toml_table,
)
from ._word import (
    chosen as chosen,
)
