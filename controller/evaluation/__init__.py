"""The controller measured beside captured clips."""
