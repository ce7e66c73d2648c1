"""Feet on the floor, live and in whole clips."""
