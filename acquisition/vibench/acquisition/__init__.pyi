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
from .check.admission import CheckRule as CheckRule, check_bench as check_bench, last_check as last_check
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
from .host.beside import Beside as Beside
from .host.installation import (
    all_shipped as all_shipped,
    built_site as built_site,
    documentation_page as documentation_page,
    file_path as file_path,
    naming_its_extra as naming_its_extra,
    require_extra as require_extra,
    require_space as require_space,
    shipped as shipped,
    shipped_folder as shipped_folder,
)
from .host.printable import printable as printable, shorten as shorten
from .host.schema import json_schema as json_schema, schema_line as schema_line
from .host.toml_file import (
    ChosenFrom as ChosenFrom,
    load_toml as load_toml,
    save_toml as save_toml,
    toml_text as toml_text,
    validate as validate,
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
from .run.run import run_measurement as run_measurement
from .stopping.program import stop_on_signal as stop_on_signal
from .stopping.stop import StopLevel as StopLevel, StopSwitch as StopSwitch
