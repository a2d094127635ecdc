"""The `vibench` command: one thin file a command, no logic.

Commands stand in a table in `__main__`, by module and function, and are imported when they are
called: listing them loads neither numpy nor Qt, and a command loads only what it needs.
The number of BLAS threads is set before numpy is loaded. People's text goes to the console;
with `--json` one document goes to standard output and nothing else. An error that a user can
mend is one sentence on standard error and a non-zero exit.

    $ vibench predict --model hertz --amplitude 5e-6 --frequency 260 --json
    $ vibench measure CAMPAIGN.toml --bench BENCH.toml --out DIR
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
