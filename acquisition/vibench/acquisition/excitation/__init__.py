"""What the generator plays: a frozen plan for each kind of excitation, and a table of the kinds.

A plan lists its steps: a tone, a waveform in the generator's memory or a stream for an analogue output, each
with the name of its segment in the recording. Amplitudes are settings, peak to peak at the terminal [V];
plans with feedback also name a motion to be held. The package `plan` computes the effect of a plan on a rig.
"""
