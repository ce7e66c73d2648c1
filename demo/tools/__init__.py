"""Programs for those who work on Patchwalk."""
