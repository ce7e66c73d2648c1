"""Styles: their files, how clips are encoded, and the bank that holds them by name."""
