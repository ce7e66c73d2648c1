"""Motion Puzzle (Jang et al. 2022): style transfer by body part."""
