"""How small changes of a motion grow: tangents, spectra of exponents, and when a motion has settled."""
