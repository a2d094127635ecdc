"""What is to be measured: measurements, campaigns, and what they will do to the rig."""
