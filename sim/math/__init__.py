"""Rotations, vectors, easing, springs and smoothing on numpy arrays."""
