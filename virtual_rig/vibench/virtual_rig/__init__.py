"""The simulated instruments, and the analogue world between them."""
