"""The figure that is drawn: its body, its skin, its colours."""
