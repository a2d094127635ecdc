from ._collision_region import (
    CollisionRegion as CollisionRegion,
    Collisions as Collisions,
    Edge as Edge,
    collisions as collisions,
)
from ._drive_frequency import (
    frequency_check as frequency_check,
)
from ._dwell import (
    DwellResponse as DwellResponse,
    dwell_response as dwell_response,
)
from ._dwell_analysis import (
    COLUMN_HZ as COLUMN_HZ,
    DwellAnalysis as DwellAnalysis,
    DwellPlan as DwellPlan,
    bound_frequencies_hz as bound_frequencies_hz,
    measured_dwell as measured_dwell,
    settled_envelope as settled_envelope,
    spectrum_columns as spectrum_columns,
)
from ._dwell_motion import (
    DwellMotion as DwellMotion,
    IrregularMotion as IrregularMotion,
    dwell_motion as dwell_motion,
    irregular_motion as irregular_motion,
)
from ._held_branch import (
    HeldBranch as HeldBranch,
    branch_sentences as branch_sentences,
    held_branch as held_branch,
)
from ._hysteresis import (
    Hysteresis as Hysteresis,
    hysteresis as hysteresis,
)
from ._jumps import (
    Jump as Jump,
    jumps as jumps,
)
from ._level_jumps import (
    hysteresis_vpp as hysteresis_vpp,
    level_jumps as level_jumps,
    level_summary as level_summary,
)
from ._stepped_response import (
    SteppedResponse as SteppedResponse,
    SteppedSineAnalysis as SteppedSineAnalysis,
    Steps as Steps,
    settled_check as settled_check,
    stepped_response as stepped_response,
)
from ._sweep import (
    SweepResponse as SweepResponse,
    SweepSums as SweepSums,
)
from ._sweep_analysis import (
    Sweep as Sweep,
    SweepAnalysis as SweepAnalysis,
    measured_sweep as measured_sweep,
    played_check as played_check,
    smooth_jumps as smooth_jumps,
)
from ._terminal_level import (
    TerminalLevel as TerminalLevel,
    terminal_levels as terminal_levels,
)
from ._tracked_resonance import (
    TrackedResonance as TrackedResonance,
    backbone_sentence as backbone_sentence,
    feedback_sentences as feedback_sentences,
    lost_levels as lost_levels,
    noted_jumps as noted_jumps,
    tracked_resonances as tracked_resonances,
)
