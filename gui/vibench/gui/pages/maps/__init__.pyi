from ._maps_page import (
    MapsPage as MapsPage,
)
