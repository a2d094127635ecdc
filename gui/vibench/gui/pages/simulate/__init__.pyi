from ._simulate_page import (
    SimulatePage as SimulatePage,
)
