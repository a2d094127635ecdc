from ._background import (
    Background as Background,
    Job as Job,
    LatestRequest as LatestRequest,
)
