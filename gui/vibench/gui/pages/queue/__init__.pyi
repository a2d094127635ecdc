from ._queue_page import (
    QueuePage as QueuePage,
)
