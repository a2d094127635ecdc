from ._budget import (
    COVERAGE as COVERAGE,
    Budget as Budget,
    Cause as Cause,
    Contribution as Contribution,
)
from ._expected import (
    Expected as Expected,
    expected_uncertainty as expected_uncertainty,
)
from ._quantities import (
    dwell_budgets as dwell_budgets,
    noise_budgets as noise_budgets,
    stepped_budgets as stepped_budgets,
    sweep_budgets as sweep_budgets,
)
from ._stated import (
    Stated as Stated,
    stated_of as stated_of,
)
