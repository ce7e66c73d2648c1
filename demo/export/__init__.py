"""Motion out of Patchwalk: video, glTF, live over the network."""
