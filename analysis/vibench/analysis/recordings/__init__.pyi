from ._channel_levels import (
    ChannelLevel as ChannelLevel,
    require_moving_channels as require_moving_channels,
)
from ._channels import (
    BASE as BASE,
    DRIVE as DRIVE,
    RESPONSE as RESPONSE,
    Channels as Channels,
    ObservedChannels as ObservedChannels,
    ProgressObserver as ProgressObserver,
    RecordedChannels as RecordedChannels,
    Stretch as Stretch,
    Unobserved as Unobserved,
    far_from as far_from,
    only_stretch as only_stretch,
    read_whole as read_whole,
)
from ._checks import (
    AbstractAnalysis as AbstractAnalysis,
    Check as Check,
    Verdict as Verdict,
    measurement_checks as measurement_checks,
)
from ._facts import (
    RecordingFacts as RecordingFacts,
    described_specimen as described_specimen,
    known_specimen as known_specimen,
    plan_of as plan_of,
    recording_facts as recording_facts,
    specimen_of as specimen_of,
)
from ._intact import (
    require_checked as require_checked,
    require_intact as require_intact,
    require_measured_size as require_measured_size,
)
from ._sensor_gain import (
    coupled_gain as coupled_gain,
    sensor_gain as sensor_gain,
)
