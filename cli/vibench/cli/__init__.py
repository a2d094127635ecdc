"""The commands of `vibench`: modules by subject that call the other packages and calculate nothing.

A table in `__main__` names the module and function of each command. A module is imported when its command is
called, so listing the commands loads neither numpy nor Qt. BLAS threads are limited before numpy is loaded.
Text for people goes to the console; with `--json`, standard output has one JSON document and nothing else.
After an error that the user can fix, one sentence goes to standard error, and the exit code is not zero.

$ vibench predict --model hertz --amplitude 5e-6 --frequency 260 --json
$ vibench measure CAMPAIGN.toml --bench BENCH.toml --out DIR
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
