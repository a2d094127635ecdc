from ._ledger import (
    FEWEST as FEWEST,
    CostLedger as CostLedger,
    Expected as Expected,
    cost_ledger as cost_ledger,
)
