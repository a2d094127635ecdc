from ._configured import (
    Ask as Ask,
    configured as configured,
    found_choices as found_choices,
)
from ._procedure import (
    FIRST_VPP as FIRST_VPP,
    DayPage as DayPage,
    first_day as first_day,
    in_a_command as in_a_command,
)
from ._questions import (
    QUESTIONS as QUESTIONS,
    Question as Question,
)
