"""Frequency responses (response over drive) from noise and multisines, with bounds at every line.

The estimators are h1, h2, hv and drive-referenced, from averaged spectra. For periodic noise, the best linear
approximation separates noise from nonlinear distortion (Pintelon & Schoukens, System Identification, 2nd ed.,
section 4.3). Resonances are fitted with frequency, damping and their uncertainties. Values are displacement
over displacement unless a view selects others.
"""
