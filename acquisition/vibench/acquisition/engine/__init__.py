"""The process that owns a bench, and the protocol for windows, commands and scripts.

`start_engine` starts the process. `EngineClient` sends requests over TCP on loopback, with a token. Messages
are JSON and raw samples; no Python object is unpickled. The engine sends data only on request, and it never
waits for a viewer. An attended run is aborted after half a second without a request, or when the parent
process ends. `Engine`, `RequestHandler`, `JobQueue` and `serving` are for programs that run an engine in
their own process, such as ``vibench measure``. See docs/engine.md and docs/decisions/0021-engine.md.

The states in which the drive may be on for a recording:

>>> from vibench.acquisition.engine import DRIVING, EngineState
>>> sorted(state.value for state in DRIVING)
['held', 'ramping_down', 'running']
>>> EngineState("armed") in DRIVING
False
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
