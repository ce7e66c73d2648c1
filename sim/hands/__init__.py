"""Hands: kept out of the body."""
