"""How a run is ended: causes, the level of each stop, and the switch between threads.

`StopSwitch` is set without a lock and read after every block. The first Ctrl-C requests a ramp, the second a
harder stop. A program that drives a bench announces itself in the state folder, where other programs find it
and leave stops for it. Nothing here concerns runs or instruments.
"""
