"""The trajectory: where the root was, is, and should be, from the stick's wish and the network's own expectation."""

import numpy as np

from controller.layout import FUTURE, OFFSETS, SAMPLE_STEP
from controller.phase import TURN_RADIUS, label_gait
from sim import rotations as rot
from sim.clip import FPS
from sim.command import Command
from sim.springs import decay, spring_step, spring_travel

DT = 1 / FPS
VELOCITY_HALFLIFE = 0.14  # seconds
FACING_HALFLIFE = 0.16  # seconds
LEASH = 0.15  # metres that the simulated body may be ahead of the character
FACING_LEASH = np.pi / 2
CREEP = (0.05, 0.2)  # metres a second of the network's step under which a standing root stays, over which it goes
STANDING_HALFLIFE = 0.2  # seconds in which a standing character's simulated body gives up half of its lead
# tau of the blend 1 - (1 - u)^tau, u seconds ahead, from the network's own future to the wish (Holden et al. 2017)
POSITION_BIAS, FACING_BIAS = 2.0, 3.0
_PAST = -OFFSETS[0]  # frames of history
_AHEAD = np.array(FUTURE) * DT  # seconds


class Trajectory:
    """The root, a second of its past, its expected future, and the simulated body that the stick drives by springs.

    Positions (2,) are world x, z in metres; facings are yaw in radians, never wrapped."""

    def __init__(self) -> None:
        self.position, self.facing = np.zeros(2), 0.0
        self.past_positions = np.zeros((_PAST + 1, 2))  # oldest first, the present last
        self.past_facings = np.zeros(_PAST + 1)
        self.past_gaits = np.tile(label_gait(np.zeros(2), np.zeros(())), (_PAST + 1, 1))
        self.expected_positions, self.expected_facings = np.zeros((len(FUTURE), 2)), np.zeros(len(FUTURE))
        self.wished_positions = np.zeros((len(FUTURE), 2))  # the last wish: what the stick asks, by springs alone
        self.simulated, self.velocity, self.acceleration = np.zeros(2), np.zeros(2), np.zeros(2)
        self.simulated_facing, self.turn_rate = 0.0, 0.0

    def samples(self, command: Command) -> dict[str, np.ndarray]:
        """Moves the simulated body by a frame; the network's trajectory input (layout.INPUT) in the root frame."""
        wish_positions, wish_facings, wish_gaits = self._wish(command)
        self.wished_positions = wish_positions
        toward_wish = {bias: 1 - (1 - _AHEAD) ** bias for bias in (POSITION_BIAS, FACING_BIAS)}
        positions = _blend(self.expected_positions, wish_positions, toward_wish[POSITION_BIAS][:, None])
        facings = _blend(self.expected_facings, wish_facings, toward_wish[FACING_BIAS])
        positions = np.concatenate([self.past_positions[::SAMPLE_STEP], positions])
        angles = np.concatenate([self.past_facings[::SAMPLE_STEP], facings]) - self.facing
        return {
            "trajectory_positions": _turn(positions - self.position, -self.facing),
            "trajectory_directions": np.stack([np.sin(angles), np.cos(angles)], axis=-1),
            "trajectory_gaits": np.concatenate([self.past_gaits[::SAMPLE_STEP], wish_gaits]),
        }

    def follow(self, step: np.ndarray, future_positions: np.ndarray, future_directions: np.ndarray) -> None:
        """Moves the root by the network's step (sideways, forward, turn) and keeps what it expects from there."""
        gait = label_gait(self.velocity, np.asarray(self.turn_rate))
        # Where the player and the network's own step both say stand, the root stays: a network never answers quite zero.
        pace = FPS * max(np.linalg.norm(step[:2]), abs(step[2]) * TURN_RADIUS)
        step = step * (1 - gait[0] * np.clip((CREEP[1] - pace) / (CREEP[1] - CREEP[0]), 0, 1))
        self.position = self.position + _turn(step[:2], self.facing)
        self.facing += step[2]
        self.expected_positions = self.position + _turn(future_positions, self.facing)
        self.expected_facings = self.facing + rot.yaw_of(future_directions)
        for past, now in ((self.past_positions, self.position), (self.past_facings, self.facing), (self.past_gaits, gait)):
            past[:-1] = past[1:]
            past[-1] = now
        self._hold_leash()

    def _wish(self, command: Command) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The simulated body's future: positions (5, 2), facings (5,), gaits (5, 3)."""
        target, wanted = command.desired_velocity, self._wanted_facing(command)
        self.simulated = self.simulated + spring_travel(self.velocity, self.acceleration, target, VELOCITY_HALFLIFE, DT)
        self.velocity, self.acceleration = spring_step(self.velocity, self.acceleration, target, VELOCITY_HALFLIFE, DT)
        self.simulated_facing, self.turn_rate = spring_step(
            self.simulated_facing, self.turn_rate, wanted, FACING_HALFLIFE, DT)
        ahead = _AHEAD[:, None]
        travel = spring_travel(self.velocity, self.acceleration, target, VELOCITY_HALFLIFE, ahead)
        velocity, _ = spring_step(self.velocity, self.acceleration, target, VELOCITY_HALFLIFE, ahead)
        facing, turn_rate = spring_step(self.simulated_facing, self.turn_rate, wanted, FACING_HALFLIFE, _AHEAD)
        return self.simulated + travel, facing, label_gait(velocity, turn_rate)

    def _wanted_facing(self, command: Command) -> float:
        """The yaw asked for, by the way from the simulated facing that is shorter; without a wish, the present one."""
        direction = np.array(command.move if command.face is None else command.face)
        if np.linalg.norm(direction) < 1e-3:
            return self.simulated_facing
        return self.simulated_facing + float(rot.wrap_angle(rot.yaw_of(direction) - self.simulated_facing))

    def _hold_leash(self) -> None:
        """The simulated body waits where the character cannot keep up with it, and comes back to it once it stands."""
        lead = self.simulated - self.position
        standing = self.past_gaits[-1, 0]
        lead *= 1 - standing * (1 - decay(STANDING_HALFLIFE, DT))
        self.simulated = self.position + lead * min(1.0, LEASH / max(np.linalg.norm(lead), 1e-9))
        turn = self.simulated_facing - self.facing
        self.simulated_facing = self.facing + float(np.clip(turn, -FACING_LEASH, FACING_LEASH))


def _turn(vectors: np.ndarray, yaw: float) -> np.ndarray:
    """Ground vectors (..., 2) as x, z turned about the vertical."""
    sine, cosine = np.sin(yaw), np.cos(yaw)
    x, z = vectors[..., 0], vectors[..., 1]
    return np.stack([cosine * x + sine * z, cosine * z - sine * x], axis=-1)


def _blend(a: np.ndarray, b: np.ndarray, share: np.ndarray) -> np.ndarray:
    return a + (b - a) * share
