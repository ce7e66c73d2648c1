"""A camera that follows the character, orbits and zooms, each change eased."""

from dataclasses import dataclass, field

import numpy as np

PITCH_LIMITS = (-0.02, 1.35)  # radians above the horizon: never under the floor
DISTANCE_LIMITS = (1.2, 14.0)  # metres
AIM_HEIGHT = 0.88  # metres: what the camera looks at
FOLLOW_HALF_LIFE = 0.08  # seconds
ORBIT_HALF_LIFE = 0.05
NEAR, FAR = 0.1, 200.0


@dataclass
class Camera:
    """Where the picture is taken from. `yaw` is the direction it looks in (radians, 0 along +Z), `pitch` how far down.

    The character first faces +Z, so the default yaw shows it from the front, a little from its left."""

    yaw: float = np.pi + 0.6
    pitch: float = 0.20
    distance: float = 3.9
    field_of_view: float = 0.66  # radians, vertical
    target: np.ndarray = field(default_factory=lambda: np.array([0.0, AIM_HEIGHT, 0.0]))

    def __post_init__(self) -> None:
        self._wanted = {"yaw": self.yaw, "pitch": self.pitch, "distance": self.distance}

    def orbit(self, yaw: float, pitch: float) -> None:
        """Turns about the character by angles in radians."""
        self._wanted["yaw"] += yaw
        self._wanted["pitch"] = float(np.clip(self._wanted["pitch"] + pitch, *PITCH_LIMITS))

    def zoom(self, notches: float) -> None:
        """Comes closer by a tenth for each notch, goes away for negative ones."""
        self._wanted["distance"] = float(np.clip(self._wanted["distance"] * 0.9**notches, *DISTANCE_LIMITS))

    def follow(self, position: np.ndarray, seconds: float) -> None:
        """Lets `seconds` pass while the character stands at `position` (3,) on the floor."""
        goal = np.array([position[0], AIM_HEIGHT, position[2]])
        self.target = self.target + (goal - self.target) * (1 - 0.5 ** (seconds / FOLLOW_HALF_LIFE))
        ease = 1 - 0.5 ** (seconds / ORBIT_HALF_LIFE)
        for name, wanted in self._wanted.items():
            setattr(self, name, getattr(self, name) + (wanted - getattr(self, name)) * ease)

    def jump(self, position: np.ndarray) -> None:
        """Aims at a character at `position` (3,) at once."""
        self.target = np.array([position[0], AIM_HEIGHT, position[2]])

    @property
    def forward(self) -> np.ndarray:
        """(3,) the direction it looks in."""
        level = np.cos(self.pitch)
        return np.array([np.sin(self.yaw) * level, -np.sin(self.pitch), np.cos(self.yaw) * level])

    @property
    def right(self) -> np.ndarray:
        """(3,) level, to the right of the picture."""
        return np.array([-np.cos(self.yaw), 0.0, np.sin(self.yaw)])

    @property
    def eye(self) -> np.ndarray:
        """(3,) where it stands."""
        return self.target - self.forward * self.distance

    def world_to_clip(self, aspect: float) -> np.ndarray:
        """(4, 4) for column vectors. A picture higher than wide keeps the horizontal field of view instead."""
        forward, right = self.forward, self.right
        up = np.cross(right, forward)
        view = np.eye(4)
        view[:3, :3] = right, up, -forward
        view[:3, 3] = -view[:3, :3] @ self.eye
        focal = min(1.0, aspect) / np.tan(self.field_of_view / 2)
        project = np.zeros((4, 4))
        project[0, 0], project[1, 1] = focal / aspect, focal
        project[2, 2:] = (FAR + NEAR) / (NEAR - FAR), 2 * FAR * NEAR / (NEAR - FAR)
        project[3, 2] = -1.0
        return project @ view
