"""The controller at run time: one frame from the player's command to a neutral pose."""

import copy
import math

import numpy as np

from controller.model import checkpoint
from controller.model.idle_layer import Idle
from controller.model.io_layout import INPUT_SIZE, INPUT_SLICES, OUTPUT, OUTPUT_SLICES, POSE, POSE_SIZE
from controller.model.network import PhaseFunctionedNetwork
from controller.model.phase_table import PhaseTable
from controller.runtime.crowd_state import put_back, select
from controller.runtime.first_foot import choose_first_foot
from controller.runtime.gathering import gather, gathered
from controller.runtime.playback import Playback
from controller.runtime.root_correction import RootCorrection
from controller.runtime.trajectory import Trajectory
from controller.runtime.wrist_limiter import WristLimiter
from sim.body.pose import Pose
from sim.command import Command, Commands
from sim.ground.ground import Ground
from sim.math import rotations as rot
from sim.math.easing import ramp
from sim.math.springs import decay
from sim.motion.clip import FPS
from sim.motion.playback_pace import OWN_PACE, Pace
from sim.torch_setup import set_up_torch

LOW_HIPS = (0.04, 0.1)  # metres below the standing pose's, between which hips that should be upright are too low
GETTING_UP_HALFLIFE = 0.15  # seconds in which they come half of the way
HIPS_HEIGHT = 1  # of a body's numbers
SETTLE_FRAMES = 180  # frames of standing before the first one shown, so that the character starts alive and at ease


class PhaseFunctionedController:
    """Neutral motion from commands, one 60 Hz frame a call (Holden et al. 2017)."""

    STATE = "trajectory", "root_correction", "wrists", "idle", "phase", "body"

    def __init__(self, network: PhaseFunctionedNetwork, fingerprint: str | None = None) -> None:
        """fingerprint: of the weight file, where the network comes from one."""
        set_up_torch()
        self.fingerprint = fingerprint
        self.network = PhaseTable(network)
        self.ground: Ground | None = None  # level floor
        self._leading: tuple[int, ...] = ()  # axes of every array: none for one character
        # What a restart begins from: the phase; positions and velocities (..., POSE_SIZE) of the last output; the idle.
        self._standing = network.standing.numpy()
        self._start = np.zeros(()), self._standing, Idle(network.idle.numpy().astype(float))
        self.restart()
        for _ in range(SETTLE_FRAMES):
            self.step(Command())
        self._start = copy.deepcopy((self.phase, self.body, self.idle))
        self.restart()

    def restart(self) -> None:
        """Back to standing, settled, at the start point, as when it was made."""
        self.trajectory = Trajectory(self._leading, self.ground)
        self.root_correction, self.wrists = RootCorrection(), WristLimiter()
        self.playback = Playback(self._leading)
        self.phase, self.body, self.idle = copy.deepcopy(self._start)

    def stand_on(self, ground: Ground | None) -> None:
        """Starts again on another ground; None for level floor."""
        if ground is not self.ground:
            self.ground = ground
            self.restart()

    def crowd(self, count: int) -> "PhaseFunctionedController":
        """So many characters side by side at the start point, driven by `Commands`: one axis in front of every
        array."""
        many = copy.copy(self)
        many._leading = (count,)
        phase, body, idle = copy.deepcopy(self._start)
        idle.easing, idle.frame = np.tile(idle.easing, (count, 1, 1, 1)), np.tile(idle.frame, count)
        many._start = np.tile(phase, count), np.tile(body, (count, 1)), idle
        many.restart()
        return many

    @classmethod
    def from_pretrained(cls, name: str = checkpoint.MODEL) -> "PhaseFunctionedController":
        """The shipped controller. Raises ValueError where its weights are missing or do not fit."""
        set_up_torch()  # before the first operation, which would start threads that then stay
        return cls(checkpoint.load(name), checkpoint.fingerprint(name))

    def step(self, command: Command | Commands, pace: Pace = OWN_PACE) -> Pose:
        """The next neutral pose, or a crowd's, at the pace of styled legs.

        At another playback rate the motion goes on by a frame only where the next one is due, or by two, and the pose
        in between is interpolated."""
        for moving in self.playback.advance(pace.rate):
            if moving.all():
                self.playback.push(self._advance(command, pace), moving)
            else:
                self.playback.push(self._advance_some(command, pace, moving), moving)
        return self.playback.pose()

    def _advance_some(self, command: Command | Commands, pace: Pace, which: np.ndarray) -> Pose:
        """The next poses of some of a crowd (n,) alone."""
        assert isinstance(command, Commands)
        some = select(self, which)
        some._leading = (int(np.count_nonzero(which)),)
        speed, rate, stride = (np.broadcast_to(value, which.shape)[which] for value in pace)
        pose = some._advance(command.of(which), Pace(speed, rate, stride))
        put_back(self, which, some)
        return pose

    def _advance(self, command: Command | Commands, pace: Pace) -> Pose:
        """The pose of the network's next frame: wish, network, then root and phase follow the output; the whole
        trajectory is moved along by what styled legs carry the root farther than its own step."""
        samples = self.trajectory.samples(command, pace.speed)
        self.phase = choose_first_foot(self.phase, self.trajectory)
        output = self._evaluate(samples)
        root = self.root_correction.step(output["root"], output["positions"], output["contacts"])
        before = self.trajectory.position
        self.trajectory.follow(root, output["future_positions"], output["future_directions"])
        if pace is not OWN_PACE:
            self.trajectory.translate(np.asarray(pace.stride - 1.0)[..., None] * (self.trajectory.position - before))
        self.phase = (self.phase + np.maximum(output["phase"][..., 0], 0.0)) % (2 * math.pi)
        return self._pose(output)

    def _evaluate(self, samples: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """The network's output by name, from the trajectory's samples and the body of the last frame."""
        x = np.empty((*self._leading, INPUT_SIZE), np.float32)
        for name, values in samples.items():
            x[..., INPUT_SLICES[name]] = values.reshape(*self._leading, -1)
        x[..., POSE] = self.body
        y = self.network(x, self.phase)
        self.body = self._get_up(y[..., :POSE_SIZE])
        y = y.astype(float)
        output = {name: y[..., where].reshape(*self._leading, *OUTPUT[name]) for name, where in OUTPUT_SLICES.items()}
        output["contacts"] = 1 / (1 + np.exp(-output["contacts"]))
        return output

    def _get_up(self, body: np.ndarray) -> np.ndarray:
        """The body (..., POSE_SIZE) that the network sees next: of one who is to stand upright and does not, nearer to
        the standing pose. Nobody in the captured motion gets up from a crouch but by walking on."""
        low = ramp(self._standing[HIPS_HEIGHT] - body[..., HIPS_HEIGHT], *LOW_HIPS) * self.trajectory.standing
        if not np.any(low):
            return body
        share = low[..., None] * (1 - decay(GETTING_UP_HALFLIFE, 1 / FPS))
        return (body + share * (self._standing - body)).astype(np.float32)

    def _pose(self, output: dict[str, np.ndarray]) -> Pose:
        """The output, given in the root frame, with the idle laid on it and placed in the world."""
        rotations, shift = self.idle.step(self.trajectory.standing, rot.from_6d(output["rotations"]))
        root = np.zeros((*self._leading, 3))
        root[..., ::2], root[..., 1] = self.trajectory.position, self.trajectory.height
        to_world = rot.from_yaw(self.trajectory.facing)
        pose = Pose(
            root_position=root,
            root_facing=rot.wrap_angle(self.trajectory.facing),
            hips=root + rot.rotate(to_world, output["positions"][..., 0, :] + shift),
            rotations=rot.multiply(to_world[..., None, :], self.wrists.step(rotations)),
            contacts=output["contacts"],
            phase=self.phase,
        )
        if not self.trajectory.jump.under_way:
            return pose
        speed = rot.length(self.trajectory.velocity)[..., 0]
        return gather(pose, gathered(self.trajectory.jump.time, speed) * self.trajectory.upright)
