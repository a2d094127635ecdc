"""A specimen as plain numbers, and the places of the state vector that every kernel advances in place."""
