"""Looking at the bench before it is trusted."""
