"""Plans (excitations, measurements, sweeps, campaigns) and their predicted effect on the rig.

A `Measurement` is one excitation with its ramps and the limits during its run. A `Campaign` is an ordered
list of measurements and nested sweeps, read from TOML. Before any motion, a model of the rig predicts the
loads of a plan (`predicted_loads`). `MeasurementPreview` compares the loads with the rig's limits. Plans are
frozen and validated. Frequencies are in Hz, times in s, amplitudes peak to peak in V. This package opens
no instrument and does not depend on bench or run. Chains of points:
docs/decisions/0014-chains-of-points.md. Feedback: docs/feedback.md.

>>> from vibench.acquisition.plan import Measurement, SineSweep, duration_s
>>> sweep = SineSweep(amplitude_vpp=1.5, start_hz=220, stop_hz=310, duration_s=6)
>>> round(duration_s(Measurement(name="up", excitation=sweep)), 3)  # with settling and ramps [s]
11.0
"""

from ..excitation.dwell import Dwell
from ..excitation.held_dwell import HeldDwell
from ..excitation.held_noise import HeldNoise, SpectrumPoint
from ..excitation.held_response import HeldResponse
from ..excitation.held_sweep import HeldSweep
from ..excitation.kinds import (
    EXCITATION_KINDS,
    Excitation,
    ExcitationKind,
    excitation_text,
    present_word,
    rows_by_kind,
)
from ..excitation.odd_multisine import OddMultisine
from ..excitation.plan import AbstractExcitation, Family, LeadIn, SignalPreview
from ..excitation.resonance_tracking import ResonanceTracking
from ..excitation.settled_sine import SettledSine
from ..excitation.sine_sweep import Hold, SineSweep
from ..excitation.stepped_level import SteppedLevel
from ..excitation.stepped_sine import FrequencySteps, SteppedSine
from ..excitation.steps import Approach, Direction, Segment, Step
from ..excitation.streamed_noise import StreamedNoise
from ..excitation.white_noise import WhiteNoise
from ._campaign import BYTES_PER_SAMPLE, Campaign, Retryable, RetryPolicy, distinct_drives, load_campaign
from ._limits import (
    LimitCheck,
    LimitSide,
    check_amplitude_vpp,
    check_phases,
    check_phasors,
    nearest_expected,
    require_within_limits,
    run_check_vpp,
    shortest_ramp_s,
)
from ._loads import BaseMotion, base_motion, needed_vpp, predicted_loads
from ._loop_time import (
    LOOK_PERIODS,
    look_s,
    loop_time_s,
)
from ._measurement_preview import (
    MeasurementPreview,
    preview_measurement,
)
from ._schedule import (
    CHECK_FREQUENCY_HZ,
    CHECK_QUIET_S,
    CHECK_S,
    FEWEST_STAIRS,
    HUSH_S,
    DriveSource,
    InRunLimits,
    Measurement,
    OnChange,
    OnOverload,
    Phase,
    Point,
    RunState,
    ScanPoint,
    drive_source_of,
    duration_s,
    half_cosine,
    known_phases,
    lead_in_s,
    lowest_setting_vpp,
    measuring_s,
    phases,
    ramp,
    require_played,
    stairs,
)
from ._sweep import (
    Range,
    RangeSpacing,
    SweepAxis,
)
from ._until import FEWEST_REALISATIONS, LOOK_FACTOR, Until

__all__ = [
    "BYTES_PER_SAMPLE",
    "CHECK_FREQUENCY_HZ",
    "CHECK_QUIET_S",
    "CHECK_S",
    "EXCITATION_KINDS",
    "FEWEST_REALISATIONS",
    "FEWEST_STAIRS",
    "HUSH_S",
    "LOOK_FACTOR",
    "LOOK_PERIODS",
    "AbstractExcitation",
    "Approach",
    "BaseMotion",
    "Campaign",
    "Direction",
    "DriveSource",
    "Dwell",
    "Excitation",
    "ExcitationKind",
    "Family",
    "FrequencySteps",
    "HeldDwell",
    "HeldNoise",
    "HeldResponse",
    "HeldSweep",
    "Hold",
    "InRunLimits",
    "LeadIn",
    "LimitCheck",
    "LimitSide",
    "Measurement",
    "MeasurementPreview",
    "OddMultisine",
    "OnChange",
    "OnOverload",
    "Phase",
    "Point",
    "Range",
    "RangeSpacing",
    "ResonanceTracking",
    "RetryPolicy",
    "Retryable",
    "RunState",
    "ScanPoint",
    "Segment",
    "SettledSine",
    "SignalPreview",
    "SineSweep",
    "SpectrumPoint",
    "Step",
    "SteppedLevel",
    "SteppedSine",
    "StreamedNoise",
    "SweepAxis",
    "Until",
    "WhiteNoise",
    "base_motion",
    "check_amplitude_vpp",
    "check_phases",
    "check_phasors",
    "distinct_drives",
    "drive_source_of",
    "duration_s",
    "excitation_text",
    "half_cosine",
    "known_phases",
    "lead_in_s",
    "load_campaign",
    "look_s",
    "loop_time_s",
    "lowest_setting_vpp",
    "measuring_s",
    "nearest_expected",
    "needed_vpp",
    "phases",
    "predicted_loads",
    "present_word",
    "preview_measurement",
    "ramp",
    "require_played",
    "require_within_limits",
    "rows_by_kind",
    "run_check_vpp",
    "shortest_ramp_s",
    "stairs",
]
