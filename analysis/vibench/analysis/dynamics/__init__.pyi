from ._branch_lines import (
    BranchDiagram as BranchDiagram,
    BranchLine as BranchLine,
    LineEvent as LineEvent,
    branch_lines as branch_lines,
    diagram_of as diagram_of,
)
from ._chain_computing import (
    ChainAnswer as ChainAnswer,
    ChainRun as ChainRun,
    chain_answer as chain_answer,
    chain_runs as chain_runs,
)
from ._dynamics_file import (
    branch_curves as branch_curves,
    read_diagram as read_diagram,
    write_chain as write_chain,
    write_diagram as write_diagram,
    write_spectrum as write_spectrum,
)
from ._map_words import (
    MOTION_CLASSES as MOTION_CLASSES,
    RecordedLevel as RecordedLevel,
    map_caption as map_caption,
    motion_classes as motion_classes,
    motion_words as motion_words,
    recorded_level as recorded_level,
    specimen_difference as specimen_difference,
)
from ._requests import (
    BranchMethod as BranchMethod,
    BranchRequest as BranchRequest,
    ChainDrive as ChainDrive,
    ChainRequest as ChainRequest,
    ExponentSpectrum as ExponentSpectrum,
    SpectrumPoint as SpectrumPoint,
    SpectrumRequest as SpectrumRequest,
    exponent_spectrum as exponent_spectrum,
    spectrum_points as spectrum_points,
)
from ._specimen_choice import (
    ContactWord as ContactWord,
    SpecimenChoice as SpecimenChoice,
)
