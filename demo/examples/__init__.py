"""Short programs, one for each thing that the library does: `python -m demo.examples.walk`."""
