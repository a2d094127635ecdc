from .bench import (
    Bench as Bench,
    BenchReport as BenchReport,
    CheckResult as CheckResult,
    Finding as Finding,
    InstrumentList as InstrumentList,
    Verdict as Verdict,
    list_instruments as list_instruments,
    list_rig_instruments as list_rig_instruments,
    open_bench as open_bench,
)
from .campaign import (
    run_campaign as run_campaign,
)
from .check import (
    CheckRule as CheckRule,
    check_bench as check_bench,
    last_check as last_check,
)
from .errors import (
    AcquisitionError as AcquisitionError,
    CheckFailed as CheckFailed,
    CheckStopped as CheckStopped,
    ConfigurationError as ConfigurationError,
    InstrumentError as InstrumentError,
    InstrumentLost as InstrumentLost,
    LimitExceeded as LimitExceeded,
    MissingLibrary as MissingLibrary,
    RecordingError as RecordingError,
)
from .host import (
    Beside as Beside,
    ChosenFrom as ChosenFrom,
    all_shipped as all_shipped,
    built_site as built_site,
    documentation_page as documentation_page,
    follow_parent as follow_parent,
    json_schema as json_schema,
    load_toml as load_toml,
    named as named,
    naming_its_extra as naming_its_extra,
    need_extra as need_extra,
    need_space as need_space,
    printable as printable,
    save_toml as save_toml,
    schema_line as schema_line,
    shipped as shipped,
    shipped_folder as shipped_folder,
    shortened as shortened,
    toml_text as toml_text,
    validated as validated,
)
from .instruments import (
    Block as Block,
    Identity as Identity,
    Overload as Overload,
)
from .plan import (
    load_campaign as load_campaign,
)
from .recording import (
    open_recording as open_recording,
)
from .run import (
    run_measurement as run_measurement,
)
from .stopping import (
    StopLevel as StopLevel,
    StopSwitch as StopSwitch,
    stop_on_signal as stop_on_signal,
)
