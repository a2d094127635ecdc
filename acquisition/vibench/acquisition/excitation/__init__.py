"""What the generator plays: a frozen plan for each kind of excitation, and a table of the kinds.

A plan lists its steps (tone, waveform of the generator's memory, stream of an analogue output) with the
segments that name them in the recording. Amplitudes are settings, peak to peak at the terminal [V]; plans
with feedback name a level of the base instead. The effect of a plan on a rig is computed in `plan`.
"""
