"""Any humanoid skeleton's motion onto ours, and back."""
