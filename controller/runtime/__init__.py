"""The controller as it runs: one frame a call."""
