"""Styles measured: as the session draws them, and clip to clip."""
