"""What a hardware configuration describes: the chain, its channels, its linear model, its knobs."""
