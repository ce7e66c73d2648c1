"""The phase-functioned controller: from the player's command to neutral motion (Holden et al. 2017)."""
