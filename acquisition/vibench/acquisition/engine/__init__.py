"""The process that owns a bench, and the protocol by which windows, commands and scripts ask it.

`start_engine` starts the process; `EngineClient` asks it over TCP on loopback, with a token, in JSON and
raw samples (nothing is unpickled). Viewers pull; the engine pushes nothing and waits for nobody. An
attended run is aborted when nobody has asked for half a second, or when the parent process ends. `Engine`,
`RequestHandler`, `JobQueue` and `serving` are for programs that are an engine themselves, as ``vibench
measure`` is. See docs/engine.md and docs/decisions/0021-engine.md.

The states in which the drive may be on for a recording:

>>> from vibench.acquisition.engine import DRIVING, EngineState
>>> sorted(state.value for state in DRIVING)
['held', 'ramping_down', 'running']
>>> EngineState("armed") in DRIVING
False
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
