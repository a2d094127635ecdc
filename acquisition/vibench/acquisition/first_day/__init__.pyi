from ._configured import (
    configured as configured,
)
from ._procedure import (
    DayPage as DayPage,
    first_day as first_day,
    in_a_command as in_a_command,
)
from ._questions import (
    QUESTIONS as QUESTIONS,
    Question as Question,
)
