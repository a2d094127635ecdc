"""Real instruments: the only place, with `virtual`, that talks to pyvisa and nidaqmx."""
