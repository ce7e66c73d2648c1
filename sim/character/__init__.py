"""The user's own character: a skinned humanoid read from glTF or VRM, moved as ours moves, and written again."""
