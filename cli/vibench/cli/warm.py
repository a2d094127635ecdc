"""`vibench warm`: does nothing; the command is kept because existing scripts may call it."""

from .output import console


def warm() -> None:
    """Print that nothing needs compiling, because the simulation was compiled with vibench."""
    console.print("Nothing needs compiling: the simulation was compiled when vibench was built.")
