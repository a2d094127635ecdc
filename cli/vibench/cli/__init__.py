"""The commands of `vibench`, each in a short module that calls the other packages and calculates nothing.

A table in `__main__` names each command's module and function. A command is imported when it is called, so
the list of commands loads neither numpy nor Qt. The number of BLAS threads is set before numpy is loaded.
Text for people goes to the console; with `--json`, standard output holds only one JSON document.
An error that a user can fix prints one sentence on standard error and sets a non-zero exit code.

$ vibench predict --model hertz --amplitude 5e-6 --frequency 260 --json
$ vibench measure CAMPAIGN.toml --bench BENCH.toml --out DIR
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
