"""What the user has chosen: keys, styles, presets."""
