from ._admission import (
    check_and_keep as check_and_keep,
    require_fresh as require_fresh,
    require_on_record as require_on_record,
)
from ._archive import (
    last_result as last_result,
)
from ._rule import (
    CheckRule as CheckRule,
)
