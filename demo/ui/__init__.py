"""Panels, menus and hints: what is drawn flat over the scene."""
