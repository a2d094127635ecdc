from ._ledger import (
    FEWEST as FEWEST,
    CostLedger as CostLedger,
    Expected as Expected,
    cost_ledger as cost_ledger,
)
from ._state_folder import (
    VARIABLE as VARIABLE,
    state_folder as state_folder,
)
