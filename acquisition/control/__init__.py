"""Steps that depend on what was measured: clocks, settling, level, jumps, resonances, and who conducts them."""
