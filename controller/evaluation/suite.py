"""What the controller is evaluated on: a fixed suite of sticks, ten minutes of random ones, the paths of real clips."""

import copy
import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Callable, Sequence

import numpy as np

from controller.model.gait_phase import label_gait
from controller.runtime.controller import PhaseFunctionedController
from controller.runtime.trajectory import rotate_2d
from sim.body.kinematics import to_local
from sim.body.pose import Pose
from sim.body.skeleton import CONTACT_JOINTS
from sim.command import GAIT_SPEEDS, Command
from sim.ground.catalogue import FLAT, NAMES, load_ground
from sim.ground.ground import Ground
from sim.motion.clip import FPS, Clip, RootFrame, root_frame
from sim.motion.contacts import foot_contacts
from sim.motion.features import features_from
from sim.session import Session
from sim.style_spec import StyleSpec

Script = Sequence[Command]  # one a frame

FORWARD, BACK, LEFT, RIGHT = (0.0, 1.0), (0.0, -1.0), (1.0, 0.0), (-1.0, 0.0)
WAIT = 1.0  # seconds of standing before the stick moves
SPEEDS = (("walk", 0.4), ("walk", 0.8), ("walk", 1.3), ("run", 2.0), ("run", 3.0), ("run", 3.5))  # metres a second
FACING_FORWARD = {
    "strafe left": LEFT,
    "strafe right": RIGHT,
    "diagonal left": (0.6, 0.8),
    "diagonal right": (-0.6, 0.8),
    "back": BACK,
    "back left": (0.6, -0.8),
    "back right": (-0.6, -0.8),
}
CYCLE = {"walk": 1.1, "run": 0.7}  # seconds: reversals and stops come at four instants of one cycle, so at either foot
INSTANTS = 4
TURNS = (45, 90, 135)  # degrees to the left
TURN_ON_THE_SPOT = "turn on the spot"
CROUCHES = {
    "moves": ("crouch", "crouch back", "crouch left", "crouch right", "crouch diagonal"),
    "changes": ("crouch from standing", "crouch from walking", "crouch from running"),
}
JUMPS = ("jump on the spot", "jump from a walk", "jump from a run")
PRESS_SECONDS = 2.0  # after WAIT that the jump is pressed
TERRAIN_GAITS, TERRAIN_WAYS, TERRAIN_SECONDS = ("walk", "run", "crouch"), (0, 40, 90, 180), 8  # degrees from the start
STAND_SECONDS = 20
RANDOM_SECONDS = 600
RANDOM_GAITS, RANDOM_JUMPS = {"walk": 0.4, "run": 0.4, "crouch": 0.2}, 0.05  # how likely each is
FOLLOW_SECONDS = 10  # of each real clip, so that no long one outweighs the others
LEAD_IN_SECONDS = 2  # to get from standing to what a real clip begins with


@dataclass(frozen=True)
class Motion:
    """A motion as it is measured, played or real: positions (F, 21, 3) and global rotations (F, 21, 4) in the world,
    the root frame, contacts (F, 4) in 0..1."""

    positions: np.ndarray
    rotations: np.ndarray
    root: RootFrame
    contacts: np.ndarray
    crouch: np.ndarray | float = 0.0  # (F,) of a labelled clip

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, frames: slice) -> "Motion":
        root = RootFrame(self.root.positions[frames], self.root.facing[frames])
        return replace(
            self,
            positions=self.positions[frames],
            rotations=self.rotations[frames],
            root=root,
            contacts=self.contacts[frames],
        )

    @classmethod
    def of_clip(cls, clip: Clip) -> "Motion":
        """A captured clip, grounded and at 60 frames a second."""
        positions = clip.positions()
        return cls(positions, clip.global_rotations(), root_frame(positions), foot_contacts(clip))

    @classmethod
    def of_poses(cls, poses: Sequence[Pose]) -> "Motion":
        """What a session played; the root frame is the controller's own."""
        facing = np.unwrap(np.array([pose.root_facing for pose in poses]))
        root = RootFrame(np.array([pose.root_position for pose in poses]), facing)
        positions, rotations, contacts = (
            np.array([getattr(pose, name) for pose in poses]) for name in ("positions", "rotations", "contacts")
        )
        return cls(positions, rotations, root, contacts)

    @cached_property
    def velocity(self) -> np.ndarray:
        """The root's (F, 2), x and z in metres a second, since the frame before."""
        steps = np.diff(self.root.positions[:, [0, 2]], axis=0) * FPS
        return np.concatenate([steps[:1], steps])

    @cached_property
    def turn_rate(self) -> np.ndarray:
        """The root's (F,), radians a second."""
        return np.gradient(self.root.facing, 1 / FPS)

    @cached_property
    def gait(self) -> np.ndarray:
        """Weights (F, GAITS) of standing, walking and running, by the root's velocity, for played and real alike."""
        return label_gait(self.velocity, self.turn_rate)

    @cached_property
    def feet(self) -> np.ndarray:
        """(F, 4, 3): left foot, left toe, right foot, right toe."""
        return self.positions[:, CONTACT_JOINTS]

    @property
    def local_rotations(self) -> np.ndarray:
        """(F, 21, 4)."""
        return to_local(self.rotations)

    def features(self) -> np.ndarray:
        """Motion features (F - STRIDE, 21, 15), of all frames that have a velocity."""
        return features_from(self.positions, self.rotations, self.root.positions, self.root.facing)


@dataclass(frozen=True)
class Trial:
    """A script and what came of it: the motion before and after the foot lock, the simulated body's place (F, 2), the
    velocity (F, 2) that it is driven to, slowed on slopes; the ground, None for level floor, and its name."""

    script: Script
    neutral: Motion
    locked: Motion
    simulated: np.ndarray
    wanted: np.ndarray = field(default_factory=lambda: np.empty((0, 2)))
    ground: Ground | None = None
    ground_name: str = FLAT

    @property
    def desired(self) -> np.ndarray:
        """The velocity the stick asks for (F, 2)."""
        return np.array([command.desired_velocity for command in self.script])

    @property
    def lead(self) -> np.ndarray:
        """How far (F,) the simulated body is from the character, in metres."""
        return np.linalg.norm(self.simulated - self.neutral.root.positions[:, [0, 2]], axis=1)


class Unstyled:
    """In the stylizer's place: the neutral pose passes through, as it does while no style is asked for."""

    own_of: str | None = None

    def step(
        self,
        window: np.ndarray,
        neutral: Pose,
        style: StyleSpec | Sequence[StyleSpec],
        travel: np.ndarray | float = 1.0,
    ) -> Pose:
        """The neutral pose itself."""
        return neutral

    def leg_strengths(self) -> np.ndarray:
        """No leg is styled."""
        return np.zeros(2)

    def pace(self, gaits: Sequence[str]) -> tuple[float, float]:
        """The controller's own."""
        return 1.0, 1.0

    def restart(self) -> None:
        """Nothing is remembered."""

    def crowd(self, count: int) -> "Unstyled":
        """It passes a crowd through as well."""
        return self


def play(
    script: Script,
    standing: PhaseFunctionedController,
    tick: Callable[[], object] = lambda: None,
    ground: str = FLAT,
) -> Trial:
    """The script through a new session on a ground, from how a new controller stands; that one is left as it is. `tick`
    is called once a frame."""
    controller = copy.deepcopy(standing)
    session = Session(controller, Unstyled(), ground=load_ground(ground))
    frames, simulated, wanted = [], [], []
    for command in script:
        frames.append(session.step(command))
        simulated.append(controller.trajectory.simulated)
        wanted.append(controller.trajectory.wanted_velocity)
        tick()
    return Trial(
        script,
        Motion.of_poses([frame.neutral for frame in frames]),
        Motion.of_poses([frame.styled for frame in frames]),
        np.array(simulated),
        np.array(wanted),
        session.ground,
        ground,
    )


def script(*stretches: tuple[float, Command]) -> Script:
    """Seconds and command, one after the other, after WAIT seconds of standing."""
    return [command for seconds, command in ((WAIT, Command()), *stretches) for _ in range(round(seconds * FPS))]


def suite() -> dict[str, Script]:
    """The fixed suite by name. A speed that the stick cannot ask for is left out."""
    walk, run = Command(FORWARD), Command(FORWARD, gait="run")
    moves = {
        speed_name(gait, speed): script((4, Command((0.0, speed / GAIT_SPEEDS[gait]), gait=gait)))
        for gait, speed in SPEEDS
        if speed <= GAIT_SPEEDS[gait]
    }
    moves |= {name: script((4, Command(move, FORWARD))) for name, move in FACING_FORWARD.items()}
    for gait, go in (("walk", walk), ("run", run)):
        back = Command(BACK, gait=gait)
        for kind, after in (("reverse", [(3, back)]), ("stop", [(2.5, Command()), (3, walk)])):
            for instant in range(INSTANTS):
                moves[f"{kind} {gait} {instant}"] = script((3 + CYCLE[gait] * instant / INSTANTS, go), *after)
        for angle in TURNS:
            aside = (math.sin(math.radians(angle)), math.cos(math.radians(angle)))
            moves[f"turn {gait} {angle}"] = script((3, go), (3, Command(aside, gait=gait)))
    moves[TURN_ON_THE_SPOT] = script((2, Command(face=LEFT)), (2, Command(face=RIGHT)))
    moves["walk run walk"] = script((3, walk), (3, run), (3, walk))
    moves["stand"] = script((STAND_SECONDS - WAIT, Command()))
    ways = (FORWARD, BACK, LEFT, RIGHT, (0.6, 0.8))
    moves |= {
        name: script((4, Command(way, FORWARD, "crouch"))) for name, way in zip(CROUCHES["moves"], ways, strict=True)
    }
    starts = (Command(), walk, run)
    for name, go in zip(CROUCHES["changes"], starts, strict=True):
        moves[name] = script((2, go), (3, replace(go, gait="crouch")), (3, go))
    for name, go in zip(JUMPS, starts, strict=True):
        moves[name] = script((PRESS_SECONDS, go), (1 / FPS, replace(go, jump=True)), (2.5, go))
    return moves


def terrain_suite() -> dict[str, tuple[str, Script]]:
    """What is walked on uneven ground: the ground's name and the script, by name."""
    return {
        f"{ground}, {gait}, {way} degrees": (
            ground,
            script((TERRAIN_SECONDS, Command((math.sin(math.radians(way)), math.cos(math.radians(way))), gait=gait))),
        )
        for ground in NAMES
        if ground != FLAT
        for gait in TERRAIN_GAITS
        for way in TERRAIN_WAYS
    }


def speed_name(gait: str, speed: float) -> str:
    """The name that straight movement at a speed has in the suite."""
    return f"{gait} {speed} m/s"


def random_sticks(seconds: float = RANDOM_SECONDS, seed: int = 1) -> Script:
    """Restless thumbs: every 0.3 to 3 s another direction, stick length, gait and, two times in five, facing; now and
    then a jump."""
    random = np.random.default_rng(seed)
    commands: list[Command] = []
    while len(commands) < seconds * FPS:
        move, face = ((float(np.sin(angle)), float(np.cos(angle))) for angle in random.uniform(0, 2 * np.pi, 2))
        length = 0.0 if random.random() < 0.2 else float(random.uniform(0.3, 1.0))
        command = Command(
            (move[0] * length, move[1] * length),
            face if random.random() < 0.4 else None,
            str(random.choice(list(RANDOM_GAITS), p=list(RANDOM_GAITS.values()))),
        )
        stretch = [command] * round(random.uniform(0.3, 3.0) * FPS)
        if random.random() < RANDOM_JUMPS:
            stretch[0] = replace(command, jump=True)
        commands += stretch
    return commands[: round(seconds * FPS)]


def follow(clip: Motion) -> Script:
    """The sticks that ask for a real clip's path, root velocity and facing, after LEAD_IN_SECONDS of how it begins."""
    velocity = rotate_2d(clip.velocity, -clip.root.facing[0])
    facing = clip.root.facing - clip.root.facing[0]
    commands = [_asking_for(v, (float(np.sin(yaw)), float(np.cos(yaw)))) for v, yaw in zip(velocity, facing)]
    return [commands[0]] * (LEAD_IN_SECONDS * FPS) + commands[: FOLLOW_SECONDS * FPS]


def compare(clip: Motion, played: Motion) -> tuple[Motion, Motion]:
    """A real clip and what was played along its path, both cut to the frames that they share."""
    return clip[: FOLLOW_SECONDS * FPS], played[LEAD_IN_SECONDS * FPS :]


def _asking_for(velocity: np.ndarray, face: tuple[float, float]) -> Command:
    """The command whose desired velocity is this one, or as near as a full stick comes."""
    gait = "walk" if np.linalg.norm(velocity) <= GAIT_SPEEDS["walk"] else "run"
    stick = velocity / max(GAIT_SPEEDS[gait], float(np.linalg.norm(velocity)))
    return Command((float(stick[0]), float(stick[1])), face, gait)
