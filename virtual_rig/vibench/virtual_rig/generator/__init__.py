"""The simulated AFG1022: its commands, its memory, and the voltage at its terminal."""
