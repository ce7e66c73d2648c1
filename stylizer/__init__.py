"""Style transfer by body part: the networks, their training, the style bank and the live stylizer."""
