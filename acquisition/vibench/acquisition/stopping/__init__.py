"""How a run is ended: causes, how hard each of them stops, and the switch between threads.

`StopSwitch` is set without a lock and read after every block. The first Ctrl-C asks for a ramp, the
second insists. A program that drives a bench announces itself in the state folder, where others find it and
put down stops for it. Knows neither runs nor instruments.
"""
