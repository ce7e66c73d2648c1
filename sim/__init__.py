"""The body and its time: skeleton, rotations, kinematics, clips, contacts, recording, latency and the session."""
