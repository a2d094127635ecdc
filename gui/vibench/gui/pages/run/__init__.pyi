from ._run_page import (
    RunPage as RunPage,
)
