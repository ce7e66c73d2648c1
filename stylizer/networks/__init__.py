"""Layers and graphs that the style-transfer systems share, and their weight files."""
