from ._test_page import (
    TestPage as TestPage,
)
