from ._compare_page import (
    ComparePage as ComparePage,
)
