"""Clips of motion, what is computed from them, and how they are measured."""
