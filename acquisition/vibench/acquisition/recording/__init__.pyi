from ._disk import DiskTrouble as DiskTrouble, sole_use as sole_use, trouble_disks as trouble_disks
from ._dropouts import (
    DROPOUT_DELAY_S as DROPOUT_DELAY_S,
    BridgedChannel as BridgedChannel,
    Dropout as Dropout,
    bridge as bridge,
    find_dropouts as find_dropouts,
    first_undecided as first_undecided,
)
from ._feedback_note import (
    BranchEnd as BranchEnd,
    BranchEndNote as BranchEndNote,
    BranchPointNote as BranchPointNote,
    BranchStabilityNote as BranchStabilityNote,
    DwellNote as DwellNote,
    ExcursionNote as ExcursionNote,
    FeedbackNote as FeedbackNote,
    HeldResponseNote as HeldResponseNote,
    Hold as Hold,
    JumpNote as JumpNote,
    JumpSearchEnd as JumpSearchEnd,
    JumpSide as JumpSide,
    LevelNote as LevelNote,
    LockResult as LockResult,
    NoiseNote as NoiseNote,
    ResonanceNote as ResonanceNote,
    SegmentNote as SegmentNote,
    SettledNote as SettledNote,
    Stability as Stability,
    Steadiness as Steadiness,
    SweepNote as SweepNote,
    UntilNote as UntilNote,
    feedback_note as feedback_note,
)
from ._finalise import (
    recover as recover,
)
from ._header import (
    ROLE_PATTERN as ROLE_PATTERN,
    ChannelHeader as ChannelHeader,
    RecordingHeader as RecordingHeader,
    collect_provenance as collect_provenance,
    coupling_cut_hz as coupling_cut_hz,
)
from ._layout import (
    CHUNK_SAMPLES as CHUNK_SAMPLES,
    GAPS as GAPS,
    MISSING_COUNT as MISSING_COUNT,
    PART_SUFFIX as PART_SUFFIX,
    SUFFIX as SUFFIX,
    Origin as Origin,
    RecordingState as RecordingState,
    part_of as part_of,
    tmp_of as tmp_of,
)
from ._overview import (
    BIN_SAMPLES as BIN_SAMPLES,
    CountOverview as CountOverview,
    OverviewSums as OverviewSums,
)
from ._preallocate import (
    HOLD_ROOM_S as HOLD_ROOM_S,
)
from ._reader import (
    RecordedBlock as RecordedBlock,
    Recording as Recording,
    RecordingDescription as RecordingDescription,
    name_now as name_now,
    open_recording as open_recording,
)
from ._results import (
    ResultArray as ResultArray,
    SavedResult as SavedResult,
)
from ._seal import (
    JOURNAL_SUFFIX as JOURNAL_SUFFIX,
    KEY_VARIABLE as KEY_VARIABLE,
    NotedSeal as NotedSeal,
    SealCheck as SealCheck,
    SealDepth as SealDepth,
    SealKey as SealKey,
    SealState as SealState,
    close_on_error as close_on_error,
    copy_sentence as copy_sentence,
    first_copies as first_copies,
    forget_checks as forget_checks,
    noted_seals as noted_seals,
    open_database as open_database,
    open_read_only as open_read_only,
    seal_key as seal_key,
)
from ._tables import (
    REJECTED as REJECTED,
    EventKind as EventKind,
    SegmentLabel as SegmentLabel,
)
from ._writer import (
    RecordingWriter as RecordingWriter,
    create_recording as create_recording,
)
