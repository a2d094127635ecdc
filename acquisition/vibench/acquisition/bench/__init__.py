"""Open the instruments of a rig, all or none, and close them with the generator silent.

`open_bench` opens a rig's generator, converter and analogue output, for one program at a time
(`BenchLock`); `list_instruments` lists the instruments that could be opened. The package also defines the
findings and the stored result of a bench check. Only this package starts simulated instruments: it loads
`vibench.virtual_rig` by name when a configuration has a table ``[virtual]``.
"""
