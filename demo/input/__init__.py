"""Keyboard, gamepad and mouse."""
