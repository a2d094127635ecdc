from ._base_level import (
    HeldAcceleration as HeldAcceleration,
    RelativeSetting as RelativeSetting,
    RmsSetting as RmsSetting,
)
from ._branch_continuation import (
    BranchContinuation as BranchContinuation,
)
from ._direction import (
    Approach as Approach,
    Direction as Direction,
)
from ._dwell import (
    MOST_LEAD_INS as MOST_LEAD_INS,
    Dwell as Dwell,
)
from ._feedback import (
    BaseLevel as BaseLevel,
    Settling as Settling,
)
from ._held_dwell import (
    HeldDwell as HeldDwell,
)
from ._held_noise import (
    HeldNoise as HeldNoise,
    SpectrumPoint as SpectrumPoint,
    density_at as density_at,
)
from ._held_response import (
    HeldResponse as HeldResponse,
)
from ._held_sweep import (
    HeldSweep as HeldSweep,
)
from ._kinds import (
    EXCITATION_KINDS as EXCITATION_KINDS,
    Excitation as Excitation,
    ExcitationKind as ExcitationKind,
    excitation_text as excitation_text,
    present_word as present_word,
    rows_by_kind as rows_by_kind,
)
from ._multisine import (
    held_lines as held_lines,
    shaped_period as shaped_period,
)
from ._odd_multisine import (
    OddMultisine as OddMultisine,
)
from ._plan import (
    AbstractExcitation as AbstractExcitation,
    AbstractFeedback as AbstractFeedback,
    Family as Family,
    LeadIn as LeadIn,
)
from ._preview import (
    SignalPreview as SignalPreview,
)
from ._resonance_tracking import (
    ResonanceTracking as ResonanceTracking,
)
from ._settled_sine import (
    GLIDE_TONE_S as GLIDE_TONE_S,
    SettledSine as SettledSine,
)
from ._sine_sweep import (
    Hold as Hold,
    SineSweep as SineSweep,
)
from ._stepped_level import (
    SteppedLevel as SteppedLevel,
)
from ._stepped_sine import (
    FrequencySteps as FrequencySteps,
    SteppedSine as SteppedSine,
)
from ._steps import (
    LoopTone as LoopTone,
    Play as Play,
    Samples as Samples,
    SampleSource as SampleSource,
    Segment as Segment,
    Step as Step,
    Stream as Stream,
    Tone as Tone,
    Waveform as Waveform,
)
from ._streamed_noise import (
    StreamedNoise as StreamedNoise,
)
from ._white_noise import (
    WhiteNoise as WhiteNoise,
)
