"""A campaign that one can leave alone: its journal, its retries, who is told, and a folder's catalogue."""
