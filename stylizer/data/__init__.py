"""Clips, their labels and batches for training."""
