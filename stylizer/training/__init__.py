"""From clips in many styles to weights and style files."""
