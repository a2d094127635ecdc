"""`vibench warm`: once compiled the simulation before its first use; scripts may still call it."""

from .output import console


def warm() -> None:
    """Say that nothing needs compiling: the simulation was compiled when vibench was built."""
    console.print("Nothing needs compiling: the simulation was compiled when vibench was built.")
