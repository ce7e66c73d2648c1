"""The trajectory: where the root was, is, and should be, from the stick's wish and the network's own expectation."""

import math

import numpy as np

from controller.layout import FUTURE, GAITS, OFFSETS, SAMPLE_STEP
from controller.phase import TURN_RADIUS, label_gait
from sim import rotations as rot
from sim.clip import FPS
from sim.command import Command
from sim.springs import decay, response, spring_step, spring_travel

DT = 1 / FPS
VELOCITY_HALFLIFE, STOP_HALFLIFE = 0.14, 0.12  # seconds, while the stick asks for movement and when it is let go
FACING_HALFLIFE = 0.16  # seconds
LEASH = 0.15  # metres that the simulated body may be ahead of the character
FACING_LEASH = np.pi / 2
CREEP = (0.1, 0.35)  # metres a second of the network's step under which a standing root stays, over which it goes
STANDING_HALFLIFE = 0.2  # seconds in which a standing character's simulated body gives up half of its lead
# tau of the blend 1 - (1 - u)^tau, u seconds ahead, from the network's own future to the wish (Holden et al. 2017)
POSITION_BIAS, FACING_BIAS = 2.0, 3.0
_PAST = -OFFSETS[0]  # frames of history
_AHEAD = np.array(FUTURE) * DT  # seconds
_NOW_AND_AHEAD = np.append(0.0, _AHEAD)
_TOWARD_POSITION, _TOWARD_FACING = (1 - (1 - _AHEAD) ** bias for bias in (POSITION_BIAS, FACING_BIAS))
# Springs as matrices (sim.springs.response): a frame's step of both, then the future they lead to.
_GOING, _STOPPING = ((
    np.concatenate([response(spring_travel, halflife, DT), response(spring_step, halflife, DT)]),
    np.concatenate([response(spring_travel, halflife, _AHEAD),
                    response(spring_step, halflife, _NOW_AND_AHEAD)[:len(_NOW_AND_AHEAD)]]),
) for halflife in (VELOCITY_HALFLIFE, STOP_HALFLIFE))
_STEP_TURN = response(spring_step, FACING_HALFLIFE, DT)
_FUTURE_TURNS = response(spring_step, FACING_HALFLIFE, _NOW_AND_AHEAD)
_PLACE, _FACING, _GAIT = slice(0, 2), 2, slice(3, 3 + len(GAITS))  # columns of a root's row: x, z, yaw, gait weights


class Trajectory:
    """The root, a second of its past, its expected future, and the simulated body that the stick drives by springs.

    Positions (2,) are world x, z in metres; facings are yaw in radians, never wrapped."""

    def __init__(self) -> None:
        self.position, self.facing = np.zeros(2), 0.0
        self.past = np.zeros((_PAST + 1, _GAIT.stop))  # rows of the root, oldest first, the present last
        self.past[:, _GAIT] = label_gait(np.zeros(2), np.zeros(()))
        self.expected_positions, self.expected_facings = np.zeros((len(FUTURE), 2)), np.zeros(len(FUTURE))
        self.wished_positions = np.zeros((len(FUTURE), 2))  # the last wish: what the stick asks, by springs alone
        self.simulated = np.zeros(2)
        self._moving = np.zeros((3, 2))  # of the simulated body: velocity, acceleration, wanted velocity
        self._turning = np.zeros(3)  # the same of its turning: facing, turn rate, wanted facing
        self.gait = self.past[-1, _GAIT].copy()  # of the simulated body now

    @property
    def past_positions(self) -> np.ndarray:
        """(61, 2) of the root, a frame each, the present last."""
        return self.past[:, _PLACE]

    @property
    def velocity(self) -> np.ndarray:
        """(2,) of the simulated body, metres a second."""
        return self._moving[0]

    @property
    def standing(self) -> float:
        """0..1, by the gait of the newest frame."""
        return float(self.past[-1, _GAIT.start + GAITS.index("stand")])

    def samples(self, command: Command) -> dict[str, np.ndarray]:
        """Moves the simulated body by a frame; the network's trajectory input (layout.INPUT) in the root frame."""
        self.wished_positions, wished_facings, wished_gaits = self._wish(command)
        rows = np.empty((len(OFFSETS), _GAIT.stop))
        past, future = rows[:-len(FUTURE)], rows[-len(FUTURE):]
        past[:] = self.past[::SAMPLE_STEP]
        future[:, _PLACE] = _blend(self.expected_positions, self.wished_positions, _TOWARD_POSITION[:, None])
        future[:, _FACING] = _blend(self.expected_facings, wished_facings, _TOWARD_FACING)
        future[:, _GAIT] = wished_gaits
        angles = rows[:, _FACING] - self.facing
        directions = np.empty((len(OFFSETS), 2))
        directions[:, 0], directions[:, 1] = np.sin(angles), np.cos(angles)
        return {
            "trajectory_positions": turned(rows[:, _PLACE] - self.position, -self.facing),
            "trajectory_directions": directions,
            "trajectory_gaits": rows[:, _GAIT],
        }

    def follow(self, step: np.ndarray, future_positions: np.ndarray, future_directions: np.ndarray) -> None:
        """Moves the root by the network's step (sideways, forward, turn) and keeps what it expects from there."""
        # Where the player and the network's own step both say stand, the root stays: a network never answers quite zero.
        pace = FPS * max(math.hypot(step[0], step[1]), abs(step[2]) * TURN_RADIUS)
        step = step * (1 - self.gait[0] * min(max((CREEP[1] - pace) / (CREEP[1] - CREEP[0]), 0.0), 1.0))
        self.position = self.position + turned(step[:2], self.facing)
        self.facing += float(step[2])
        self.expected_positions = self.position + turned(future_positions, self.facing)
        self.expected_facings = self.facing + rot.yaw_of(future_directions)
        self.past[:-1] = self.past[1:]
        self.past[-1, _PLACE], self.past[-1, _FACING], self.past[-1, _GAIT] = self.position, self.facing, self.gait
        self._hold_leash()

    def _wish(self, command: Command) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The simulated body's future: positions (5, 2), facings (5,), gaits (5, 3)."""
        self._moving[2] = command.desired_velocity
        step_move, future_moves = _GOING if self._moving[2].any() else _STOPPING
        step = step_move @ self._moving
        self.simulated = self.simulated + step[0]
        self._moving[:2] = step[1:]
        self._turning[2] = self._wanted_facing(command)
        self._turning[:2] = _STEP_TURN @ self._turning
        moves, turns = future_moves @ self._moving, (_FUTURE_TURNS @ self._turning).reshape(2, -1)
        gaits = label_gait(moves[len(FUTURE):], turns[1])
        self.gait = gaits[0]
        return self.simulated + moves[:len(FUTURE)], turns[0, 1:], gaits[1:]

    def _wanted_facing(self, command: Command) -> float:
        """The yaw asked for, by the way from the simulated facing that is shorter; without a wish, the present one."""
        x, z = command.move if command.face is None else command.face
        facing = float(self._turning[0])
        return facing + (rot.wrap_angle(math.atan2(x, z) - facing) if math.hypot(x, z) >= 1e-3 else 0.0)

    def _hold_leash(self) -> None:
        """The simulated body waits where the character cannot keep up with it, and comes back to it once it stands."""
        lead = (self.simulated - self.position) * (1 - self.standing * (1 - decay(STANDING_HALFLIFE, DT)))
        self.simulated = self.position + lead * min(1.0, LEASH / max(math.hypot(*lead), 1e-9))
        turn = float(self._turning[0]) - self.facing
        self._turning[0] = self.facing + min(max(turn, -FACING_LEASH), FACING_LEASH)


def turned(vectors: np.ndarray, yaw: float) -> np.ndarray:
    """Vectors (..., 2) over the floor, x and z, turned about the vertical by a yaw in radians."""
    sine, cosine = math.sin(yaw), math.cos(yaw)
    return vectors @ np.array([[cosine, -sine], [sine, cosine]])


def _blend(a: np.ndarray, b: np.ndarray, share: np.ndarray) -> np.ndarray:
    return a + (b - a) * share
