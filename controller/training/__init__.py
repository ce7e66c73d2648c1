"""From clips of neutral locomotion to weights."""
