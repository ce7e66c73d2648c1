"""Files: BVH, pose arrays, recordings; where they lie and where they come from."""
