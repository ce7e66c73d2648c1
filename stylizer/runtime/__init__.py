"""Restyling: the newest frame of a live motion, or a whole clip."""
