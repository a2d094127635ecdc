"""What is simulated, as values: specimen, contact law, drive, accuracy, and the specimen without contact.

`Specimen` and the contact laws are frozen and validated; a law also has a name in one word, `power:3+5` or
`hertz`. `Harmonic`, sweeps and `Sampled` say how the base moves, `Accuracy` how exactly to integrate,
`Outcome` how a run ended. The linear specimen is solved exactly: state matrix, modes, transmissibility, the
answer to the base with m1 free (`modes`, `against_stops`) or held by a rigid stop (`bound_modes`). State
order: x, y, z, vx, vy, vz [m, m/s], absolute. Knows nothing of steps, kernels' memory or runs.
"""

from ._accuracy import (
    Accuracy,
)
from ._against_stops import (
    BaseAnswer,
    base_answer,
)
from ._bound_modes import (
    JOIN,
    PULL,
    RATE,
    ROW,
    SHAPE,
    bound_motion,
)
from ._contact_law import (
    MOST_TERMS,
    Hertz,
    HuntCrossley,
    LinearGap,
    NoContact,
    PowerLaw,
    RigidStops,
    hertz_stiffness,
)
from ._drive import (
    Drive,
    Harmonic,
    LinearSweep,
    LogarithmicSweep,
    Sampled,
    Sweep,
)
from ._model_name import (
    model_named,
)
from ._modes import (
    COINCIDENT,
    ModalForm,
    base_transmissibility,
    harmonic_motion,
    modal_form,
    state_matrix,
)
from ._outcome import (
    Outcome,
)
from ._specimen import (
    ALUMINIUM,
    PAPER_FREQUENCIES_HZ,
    PAPER_MASSES,
    PAPER_RADIUS_M,
    STEEL,
    Matrix,
    Specimen,
    Triple,
    gong2025,
)
from ._state import (
    VX,
    VY,
    VZ,
    X,
    Y,
    Z,
)

__all__ = [
    "ALUMINIUM",
    "COINCIDENT",
    "JOIN",
    "MOST_TERMS",
    "PAPER_FREQUENCIES_HZ",
    "PAPER_MASSES",
    "PAPER_RADIUS_M",
    "PULL",
    "RATE",
    "ROW",
    "SHAPE",
    "STEEL",
    "VX",
    "VY",
    "VZ",
    "Accuracy",
    "BaseAnswer",
    "Drive",
    "Harmonic",
    "Hertz",
    "HuntCrossley",
    "LinearGap",
    "LinearSweep",
    "LogarithmicSweep",
    "Matrix",
    "ModalForm",
    "NoContact",
    "Outcome",
    "PowerLaw",
    "RigidStops",
    "Sampled",
    "Specimen",
    "Sweep",
    "Triple",
    "X",
    "Y",
    "Z",
    "base_answer",
    "base_transmissibility",
    "bound_motion",
    "gong2025",
    "harmonic_motion",
    "hertz_stiffness",
    "modal_form",
    "model_named",
    "state_matrix",
]
