"""The open instruments of a rig: opened together or not at all, and left with the generator silent.

`open_bench` opens a rig's generator, converter and analogue output, for one program at a time
(`BenchLock`); `list_instruments` says what could be opened. Findings and the kept result of a check are
values of the bench. Here, and only here, simulated instruments are switched on: `vibench.virtual_rig` is
loaded by name when the configuration asks for it.
"""
