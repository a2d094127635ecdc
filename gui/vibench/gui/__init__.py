"""The Qt window: a viewer and a remote control of the measurement; it keeps no truth of its own."""
