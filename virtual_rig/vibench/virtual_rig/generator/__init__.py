"""The simulated AFG1022: SCPI messages in, replies out, and the exact mean voltage at its terminal.

Commands, settings, waveform memories and status of the instrument, and a timeline of immutable signals on its
own clock, so that block sizes do not affect the samples. Reconstructed from the IVI driver tkafg1k and public
drivers and measurements; not compared with the laboratory's own unit. Cable and world are not imported.
"""
