"""Hands and forearms: kept out of the body."""
