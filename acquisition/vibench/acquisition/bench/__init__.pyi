from ._bench import (
    Bench as Bench,
    BenchKind as BenchKind,
    open_bench as open_bench,
)
from ._instrument_list import (
    InstrumentList as InstrumentList,
    list_instruments as list_instruments,
    list_rig_instruments as list_rig_instruments,
)
from ._lock import (
    BenchLock as BenchLock,
)
from ._protocol import (
    RunBench as RunBench,
)
from ._result import (
    BenchReport as BenchReport,
    Bounds as Bounds,
    CheckResult as CheckResult,
    Finding as Finding,
    Verdict as Verdict,
    ago as ago,
    judged as judged,
    rig_digest as rig_digest,
)
from ._rig_power import (
    RigPower as RigPower,
)
