"""The speeds and contacts at which a motion stands, walks, runs, and a foot is planted: one table for all rooms.

Two numbers are the ends of a band over which the one fades into the other; one number decides. They differ where the
signal does: the root of a captured clip, of a trajectory that springs have smoothed, of what a network predicts, or a
body that styled legs carry. Speeds are metres a second of the root over the floor unless a line says otherwise."""

# ---- standing, walking, running -----------------------------------------------------------

STAND_OR_WALK = (0.15, 0.45)  # a trajectory's gait label, and a clip that a loss compares by its speed
WALK_OR_RUN = (1.9, 2.5)  # the same
STANDING_STEP = (0.1, 0.35)  # of the network's own step: a standing root stays below, and goes above
STANDING_FEET = (0.1, 0.3)  # of the styled body, before its feet decide where it goes
STANDING_STYLE = (0.05, 0.35)  # below, nobody makes a style's steps
STANDING_MATCH = (0.2, 0.5)  # of two clips that are compared step by step
STYLE_WALK_OR_RUN = (1.8, 2.4)  # forwards, by which a style's walk and run clips are weighted
STAND_SPEED, BACK_SPEED, SIDE_SPEED, RUN_SPEED = 0.2, 0.2, 0.3, 1.7  # what names the movement of a clip
MOVING_FRAME = 0.3  # over it a captured frame is movement
MOVING_CLIP = 0.4  # over it a clip's mean is locomotion, not a gesture
CROUCHED_HIPS = (0.82, 0.9)  # metres over the floor: hips below crouch, hips above are upright
STILL_ROOT = 0.1  # under it the root of an evaluated motion stands

# ---- feet on the floor -----------------------------------------------------------

STILL_FOOT = 0.3  # under it the lowest joint of the feet stands on the floor of a clip
TOUCH_SPEED, TOUCH_SPEED_SHARE = 0.35, 0.25  # a low joint of a foot touches under this plus this share of the body's
SWINGING_FOOT = (0.4, 1.2)  # of a lifted foot, while a session runs
SWINGING_TOE = (0.5, 1.0)  # of an unplanted toe, in a clip

# Contacts, 0 to 1, of a joint of a foot.
FOOT_LOCKED = (0.2, 0.5)  # below a foot is free, above it is held
FOOT_FLAT = (0.5, 0.8)  # of both its joints: below a planted foot may roll, above it lies flat
ROOT_CARRIED = (0.4, 0.8)  # below a joint says nothing of the root's way, above it says all
PLANTED = 0.5  # above it an evaluated joint stands on the floor
