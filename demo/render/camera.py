"""A camera that follows the character, orbits and zooms, each change eased."""

from dataclasses import dataclass, field

import numpy as np

from sim.ground.ground import Ground

PITCH_LIMITS = (-0.02, 1.35)  # radians above the horizon: never under the floor
DISTANCE_LIMITS = (1.2, 14.0)  # metres
AIM = np.array([0.0, 0.88, 0.0])  # metres over the character's place: what the camera looks at
FOLLOW_HALF_LIFE = np.array([0.08, 0.15, 0.08])  # seconds, in x, y, z: unhurried over bumps
# The camera aims ahead by what following so slowly falls behind: whoever runs stays in the middle, but over bumps.
LEAD = FOLLOW_HALF_LIFE / np.log(2) * [1, 0, 1]  # seconds
LEAD_HALF_LIFE = 0.1
ORBIT_HALF_LIFE = 0.05
ROOM_HALF_LIFE = 0.1  # of the figure's way into another part of the picture
WHOLE_PICTURE = (0.0, 0.0, 1.0, 1.0)
NEAR, FAR = 0.1, 200.0
ANKLES = 0.78  # metres under the target: from there up no ground shall hide the character
CLEARANCE = 0.2  # metres that the eye stays over uneven ground
SIGHT = np.linspace(0, 1, 9)[1:]  # shares of the way from the target to the eye where the ground is looked at


@dataclass
class Camera:
    """Where the picture is taken from. `yaw` is the direction it looks in (radians, 0 along +Z), `pitch` how far down.

    The character first faces +Z, so the default yaw shows it from the front, a little from its left."""

    yaw: float = np.pi + 0.6
    pitch: float = 0.20
    distance: float = 3.9
    field_of_view: float = 0.66  # radians, vertical
    target: np.ndarray = field(default_factory=AIM.copy)
    tall: float = 1.0  # how many times as tall as the figure the character is

    def __post_init__(self) -> None:
        self._wanted = {"yaw": self.yaw, "pitch": self.pitch, "distance": self.distance}
        self._position: np.ndarray | None = None  # of the character, when it was followed last
        self._velocity = np.zeros(3)  # its, smoothed
        self._room: np.ndarray | None = None  # left, top, width, height of where the figure is, and its breadth
        self._wanted_room: np.ndarray = np.append(WHOLE_PICTURE, 1.0)

    def make_room(self, left: float, top: float, width: float, height: float, breadth: float) -> None:
        """The figure belongs into a part of the picture, given in shares of it, from now on: it glides there.

        breadth: how wide the figure is, as a share of what the field of view holds from top to bottom."""
        self._wanted_room = np.array([left, top, width, height, breadth])
        if self._room is None:
            self._room = self._wanted_room

    def orbit(self, yaw: float, pitch: float) -> None:
        """Turns about the character by angles in radians."""
        self._wanted["yaw"] += yaw
        self._wanted["pitch"] = float(np.clip(self._wanted["pitch"] + pitch, *PITCH_LIMITS))

    def zoom(self, notches: float) -> None:
        """Comes closer by a tenth for each notch, goes away for negative ones."""
        self._wanted["distance"] = float(np.clip(self._wanted["distance"] * 0.9**notches, *DISTANCE_LIMITS))

    def stand_at(self, distance: float, pitch: float) -> None:
        """Glides to so many metres away, looking down by an angle in radians, as far as it can."""
        self._wanted["distance"] = float(np.clip(distance, *DISTANCE_LIMITS))
        self._wanted["pitch"] = float(np.clip(pitch, *PITCH_LIMITS))

    def follow(
        self, position: np.ndarray, seconds: float, ground: Ground | None = None, aside: np.ndarray | float = 0.0
    ) -> None:
        """Lets `seconds` pass while the character is at `position` (3,) on a ground, None for level floor, and the
        middle of what is to be seen so far `aside` of it."""
        velocity = np.zeros(3) if self._position is None else (position - self._position) / seconds
        self._position = position
        self._velocity = self._velocity + (velocity - self._velocity) * (1 - 0.5 ** (seconds / LEAD_HALF_LIFE))
        goal = position + aside + self.tall * AIM + LEAD * self._velocity
        self.target = self.target + (goal - self.target) * (1 - 0.5 ** (seconds / FOLLOW_HALF_LIFE))
        ease = 1 - 0.5 ** (seconds / ORBIT_HALF_LIFE)
        for name, wanted in self._wanted.items():
            setattr(self, name, getattr(self, name) + (wanted - getattr(self, name)) * ease)
        if self._room is not None:
            self._room = self._room + (self._wanted_room - self._room) * (1 - 0.5 ** (seconds / ROOM_HALF_LIFE))
        self._rise_over(ground)

    def jump(self, position: np.ndarray, ground: Ground | None = None) -> None:
        """Aims at a character at `position` (3,) on a ground at once."""
        self.target, self._position, self._velocity = position + self.tall * AIM, None, np.zeros(3)
        if self._room is not None:
            self._room = self._wanted_room
        self._rise_over(ground)

    def _rise_over(self, ground: Ground | None) -> None:
        """Looks down more steeply where the ground would come over the eye or between it and the ankles."""
        if ground is None:
            return
        places = self.target + SIGHT[:, None] * (self.eye - self.target)
        over_ankles = ground.smooth_height_at(places[:, [0, 2]]) - (self.target[1] - self.tall * ANKLES)
        least = (
            (over_ankles / SIGHT).max() - self.tall * ANKLES + CLEARANCE
        )  # metres that the eye must be over the target
        self.pitch = max(
            self.pitch, float(np.arcsin(np.clip(least / (self.tall * self.distance), -1, np.sin(PITCH_LIMITS[1]))))
        )

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
        return self.target - self.forward * self.tall * self.distance

    def lens(self, aspect: float) -> tuple[float, float, float]:
        """Of a picture `aspect` times as wide as high: clip units from its middle for one metre at a distance of one,
        upwards, and clip x and y of the target. A place higher than wide keeps the field of view across instead."""
        left, top, width, height, breadth = self._wanted_room if self._room is None else self._room
        focal = height * min(1.0, aspect * width / height / breadth) / np.tan(self.field_of_view / 2)
        return float(focal), float(2 * left + width - 1), float(1 - 2 * top - height)

    def metres_a_pixel(self, size: tuple[int, int]) -> float:
        """At a distance of one metre, in a picture of (width, height) pixels."""
        return 2 / (self.lens(size[0] / size[1])[0] * size[1])

    def world_to_clip(self, aspect: float) -> np.ndarray:
        """(4, 4) for column vectors, of a picture `aspect` times as wide as high."""
        forward, right = self.forward, self.right
        up = np.cross(right, forward)
        view = np.eye(4)
        view[:3, :3] = right, up, -forward
        view[:3, 3] = -view[:3, :3] @ self.eye
        focal, across, upwards = self.lens(aspect)
        project = np.zeros((4, 4))
        project[0, 0], project[1, 1] = focal / aspect, focal
        project[:2, 2] = -across, -upwards
        project[2, 2:] = (FAR + NEAR) / (NEAR - FAR), 2 * FAR * NEAR / (NEAR - FAR)
        project[3, 2] = -1.0
        return project @ view
