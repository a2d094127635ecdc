"""The physics: specimen, contact, exact flight, responses. Imports nothing of ours."""
