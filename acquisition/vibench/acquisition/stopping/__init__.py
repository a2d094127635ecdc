"""How a run is ended: causes, levels of stops, and the flag that passes a stop between threads.

`StopSwitch` is set without a lock and read after every block. The first Ctrl-C requests a ramp, the second
Ctrl-C a harder stop. A program that drives a bench announces itself in the state folder. Other programs find
it there and leave stop requests as files. This package uses neither runs nor instruments.
"""
