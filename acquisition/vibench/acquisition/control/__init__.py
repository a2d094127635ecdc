"""Steps that depend on what was measured: clocks, settling, levels, jumps, resonances, conductors."""
