"""Plans (excitations, measurements, sweeps, campaigns) and their predicted effect on the rig.

A `Measurement` is one excitation with its ramps and with the limits during the run. A `Campaign` is an
ordered list of measurements and nested sweeps, read from TOML. Before any motion, a model of the rig predicts
the loads of a plan (`predicted_loads`). `MeasurementPreview` compares the loads with the rig's limits. Plans
are frozen and validated. Frequencies are in Hz, times in s, amplitudes peak to peak in V. This package opens
no instrument and does not depend on bench or run. Chains of points: docs/decisions/0014-chains-of-points.md.
Feedback: docs/feedback.md.

>>> from vibench.acquisition.plan import Measurement, SineSweep, duration_s
>>> sweep = SineSweep(amplitude_vpp=1.5, start_hz=220, stop_hz=310, duration_s=6)
>>> round(duration_s(Measurement(name="up", excitation=sweep)), 3)  # with settling and ramps [s]
11.0
"""

from ..excitation.dwell import Dwell as Dwell, HeldDwell as HeldDwell
from ..excitation.kinds import (
    EXCITATION_KINDS as EXCITATION_KINDS,
    Excitation as Excitation,
    ExcitationKind as ExcitationKind,
    excitation_text as excitation_text,
    present_word as present_word,
    rows_by_kind as rows_by_kind,
)
from ..excitation.noise import (
    HeldNoise as HeldNoise,
    OddMultisine as OddMultisine,
    SpectrumPoint as SpectrumPoint,
    StreamedNoise as StreamedNoise,
    WhiteNoise as WhiteNoise,
)
from ..excitation.plan import (
    AbstractExcitation as AbstractExcitation,
    Family as Family,
    LeadIn as LeadIn,
    SignalPreview as SignalPreview,
)
from ..excitation.resonance_tracking import ResonanceTracking as ResonanceTracking
from ..excitation.sine_sweep import HeldSweep as HeldSweep, Hold as Hold, SineSweep as SineSweep
from ..excitation.stepped_sine import (
    FrequencySteps as FrequencySteps,
    HeldResponse as HeldResponse,
    SettledSine as SettledSine,
    SteppedLevel as SteppedLevel,
    SteppedSine as SteppedSine,
)
from ..excitation.steps import Approach as Approach, Direction as Direction, Segment as Segment, Step as Step
from ._campaign import (
    BYTES_PER_SAMPLE as BYTES_PER_SAMPLE,
    Campaign as Campaign,
    Retryable as Retryable,
    RetryPolicy as RetryPolicy,
    distinct_drives as distinct_drives,
    load_campaign as load_campaign,
)
from ._limits import (
    LimitCheck as LimitCheck,
    LimitSide as LimitSide,
    MeasurementPreview as MeasurementPreview,
    check_amplitude_vpp as check_amplitude_vpp,
    check_phases as check_phases,
    check_phasors as check_phasors,
    nearest_expected as nearest_expected,
    preview_measurement as preview_measurement,
    preview_signal as preview_signal,
    require_within_limits as require_within_limits,
    run_check_vpp as run_check_vpp,
    shortest_ramp_s as shortest_ramp_s,
)
from ._loads import (
    BaseMotion as BaseMotion,
    base_motion as base_motion,
    needed_vpp as needed_vpp,
    predicted_loads as predicted_loads,
)
from ._schedule import (
    CHECK_FREQUENCY_HZ as CHECK_FREQUENCY_HZ,
    CHECK_QUIET_S as CHECK_QUIET_S,
    CHECK_S as CHECK_S,
    FEWEST_REALISATIONS as FEWEST_REALISATIONS,
    FEWEST_STAIRS as FEWEST_STAIRS,
    HUSH_S as HUSH_S,
    LOOK_FACTOR as LOOK_FACTOR,
    LOOK_PERIODS as LOOK_PERIODS,
    DriveSource as DriveSource,
    InRunLimits as InRunLimits,
    Measurement as Measurement,
    OnChange as OnChange,
    OnOverload as OnOverload,
    Phase as Phase,
    Point as Point,
    RunState as RunState,
    ScanPoint as ScanPoint,
    Until as Until,
    drive_source_of as drive_source_of,
    duration_s as duration_s,
    half_cosine as half_cosine,
    known_phases as known_phases,
    lead_in_s as lead_in_s,
    look_s as look_s,
    loop_time_s as loop_time_s,
    lowest_setting_vpp as lowest_setting_vpp,
    measuring_s as measuring_s,
    phases as phases,
    ramp as ramp,
    require_played as require_played,
    stairs as stairs,
)
from ._sweep import Range as Range, RangeSpacing as RangeSpacing, SweepAxis as SweepAxis

__all__ = [name for name in globals() if not name.startswith("_")]
