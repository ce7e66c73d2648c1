"""The phase-functioned network, its inputs and outputs, its weights."""
