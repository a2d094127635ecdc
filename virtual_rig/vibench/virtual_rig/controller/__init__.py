"""The simulated real-time controller: a law and a Fourier series, sample by sample, and lines of JSON.

It speaks version 1 of the protocol of `vibench.acquisition.instruments`. Its watchdog counts its own samples:
when no host has said anything for so long it ramps down, and needs nobody for that.
"""
