"""The `vibench` command: one thin file a command, no logic."""
