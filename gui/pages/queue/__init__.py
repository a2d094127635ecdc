"""The Queue page: campaigns."""
