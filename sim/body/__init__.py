"""The 21-joint skeleton, its kinematics and a pose of it."""
