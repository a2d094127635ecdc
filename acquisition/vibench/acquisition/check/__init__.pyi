from ._admission import (
    check_bench as check_bench,
    last_check as last_check,
    require_fresh as require_fresh,
    require_on_record as require_on_record,
)
from ._bench_report import (
    bench_report as bench_report,
)
from ._rule import (
    CheckRule as CheckRule,
)
