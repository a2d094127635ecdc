"""Where an engine can be asked: all that a viewer needs to know of its server."""

from ..host.toml_file import FrozenModel


class EngineAddress(FrozenModel):
    """Where an engine can be asked, and the word that lets one in."""

    host: str
    port: int
    token: str
