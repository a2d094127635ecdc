"""The Test page: what will be played, and what it will do."""
