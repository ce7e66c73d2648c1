"""The trajectory: where the root was, is, and should be, from the stick's wish and the network's own expectation."""

import numpy as np

from controller.model.gait_phase import TURN_RADIUS, label_gait
from controller.model.io_layout import FUTURE, GAITS, OFFSETS, SAMPLE_STEP
from sim.command import Command, Commands
from sim.math import rotations as rot
from sim.math.easing import ramp
from sim.math.springs import decay, response, spring_step, spring_travel
from sim.math.vectors import limit_length
from sim.motion.clip import FPS
from sim.motion.thresholds import STANDING_STEP

DT = 1 / FPS
VELOCITY_HALFLIFE, STOP_HALFLIFE = 0.14, 0.12  # seconds, while the stick asks for movement and when it is let go
FACING_HALFLIFE = 0.16  # seconds
MAX_LEAD = 0.15  # metres that the simulated body may be ahead of the character
MAX_FACING_LEAD = np.pi / 2
STANDING_HALFLIFE = 0.2  # seconds in which a standing character's simulated body gives up half of its lead
# tau of the blend 1 - (1 - u)^tau, u seconds ahead, from the network's own future to the wish (Holden et al. 2017)
POSITION_BIAS, FACING_BIAS = 2.0, 3.0
_PAST = -OFFSETS[0]  # frames of history
_AHEAD = np.array(FUTURE) * DT  # seconds
_NOW_AND_AHEAD = np.append(0.0, _AHEAD)
_TOWARD_DESIRED = 1 - (1 - _AHEAD[:, None]) ** np.array([POSITION_BIAS, POSITION_BIAS, FACING_BIAS])
_PLACE, _FACING, _GAIT = slice(0, 2), 2, slice(3, 3 + len(GAITS))  # columns of a root's row: x, z, yaw, gait weights
_ROOT = slice(0, 3)
_PRESENT, _FUTURE = slice(0, -len(FUTURE)), slice(-len(FUTURE), None)  # of the samples: up to now, and to come
# Springs as matrices (sim.math.springs.response): a frame's step of body and turning, then the future they lead to.
_STEP_MOVE, _FUTURE_MOVES = map(
    np.stack,
    zip(
        *(
            (
                np.concatenate([response(spring_travel, halflife, DT), response(spring_step, halflife, DT)]),
                np.concatenate(
                    [
                        response(spring_travel, halflife, _AHEAD),
                        response(spring_step, halflife, _NOW_AND_AHEAD)[: len(_NOW_AND_AHEAD)],
                    ]
                ),
            )
            for halflife in (STOP_HALFLIFE, VELOCITY_HALFLIFE)
        )
    ),
)
_STEP_TURN = response(spring_step, FACING_HALFLIFE, DT)
_FUTURE_TURNS = response(spring_step, FACING_HALFLIFE, _NOW_AND_AHEAD)


class Trajectory:
    """The root, a second of its past, its expected future, and the simulated body that the stick drives by springs.

    Positions (..., 2) are world x, z in metres; facings (...) are yaw in radians, never wrapped. The leading axes are
    those of a crowd: none for one character."""

    def __init__(self, crowd: tuple[int, ...] = ()) -> None:
        self.position, self.facing = np.zeros((*crowd, 2)), np.zeros(crowd)
        self.past = np.zeros((*crowd, _PAST + 1, _GAIT.stop))  # rows of the root, oldest first, the present last
        self.past[..., _GAIT] = label_gait(np.zeros(2), np.zeros(()))
        # x, z, yaw at the samples to come: what the network expects, and the last wish, what the stick asks by springs
        # alone.
        self.predicted, self.desired = np.zeros((2, *crowd, len(FUTURE), 3))
        self.simulated = np.zeros((*crowd, 2))
        self._moving = np.zeros((*crowd, 3, 2))  # of the simulated body: velocity, acceleration, wanted velocity
        self._turning = np.zeros((*crowd, 3))  # the same of its turning: facing, turn rate, wanted facing
        self.gait = self.past[..., -1, _GAIT].copy()  # of the simulated body now

    @property
    def past_positions(self) -> np.ndarray:
        """(..., 61, 2) of the root, a frame each, the present last."""
        return self.past[..., _PLACE]

    @property
    def velocity(self) -> np.ndarray:
        """(..., 2) of the simulated body, metres a second."""
        return self._moving[..., 0, :]

    @property
    def standing(self) -> np.ndarray:
        """(...) 0..1, by the gait of the newest frame."""
        return self.past[..., -1, _GAIT.start + GAITS.index("stand")]

    def samples(self, command: Command | Commands, speed: np.ndarray | float = 1.0) -> dict[str, np.ndarray]:
        """Moves the simulated body by a frame; the network's trajectory input (controller.model.io_layout.INPUT) in the
        root frame. speed: what the desired velocity is multiplied by."""
        rows = np.empty((*self.position.shape[:-1], len(OFFSETS), _GAIT.stop))
        rows[..., _PRESENT, :] = self.past[..., ::SAMPLE_STEP, :]
        rows[..., _FUTURE, _GAIT] = self._move_simulated(command, speed)
        rows[..., _FUTURE, _ROOT] = self.predicted + (self.desired - self.predicted) * _TOWARD_DESIRED
        angles = rows[..., _FACING] - self.facing[..., None]
        directions = np.empty((*angles.shape, 2))
        directions[..., 0], directions[..., 1] = np.sin(angles), np.cos(angles)
        return {
            "trajectory_positions": rotate_2d(rows[..., _PLACE] - self.position[..., None, :], -self.facing),
            "trajectory_directions": directions,
            "trajectory_gaits": rows[..., _GAIT],
        }

    def follow(self, step: np.ndarray, future_positions: np.ndarray, future_directions: np.ndarray) -> None:
        """Moves the root by the network's step (..., 3), sideways, forward, turn, and keeps what it expects from
        there."""
        # Where the player and the network's own step both say stand, the root stays: a network never gives quite
        # zero.
        pace = FPS * np.maximum(np.hypot(step[..., 0], step[..., 1]), np.abs(step[..., 2]) * TURN_RADIUS)
        step = step * (1 - self.gait[..., 0] * (1 - ramp(pace, *STANDING_STEP)))[..., None]
        self.position = self.position + rotate_2d(step[..., None, :2], self.facing)[..., 0, :]
        self.facing = self.facing + step[..., 2]
        self.predicted[..., _PLACE] = self.position[..., None, :] + rotate_2d(future_positions, self.facing)
        self.predicted[..., _FACING] = self.facing[..., None] + rot.yaw_of(future_directions)
        self.past[..., :-1, :] = self.past[..., 1:, :]
        present = self.past[..., -1, :]
        present[..., _PLACE], present[..., _FACING], present[..., _GAIT] = self.position, self.facing, self.gait
        self._limit_lead()

    def translate(self, shift: np.ndarray) -> None:
        """Moves everything by (..., 2) metres: the network sees no difference."""
        self.position = self.position + shift
        self.simulated = self.simulated + shift
        for places in (self.past, self.predicted, self.desired):
            places[..., _PLACE] += shift[..., None, :]

    def _move_simulated(self, command: Command | Commands, speed: np.ndarray | float) -> np.ndarray:
        """Moves the simulated body and predicts its future, `desired`; its gaits there (..., 5, 3)."""
        self._moving[..., 2, :] = np.asarray(speed)[..., None] * command.desired_velocity
        going = self._moving[..., 2, :].any(axis=-1).astype(int)
        step = _STEP_MOVE[going] @ self._moving
        self.simulated = self.simulated + step[..., 0, :]
        self._moving[..., :2, :] = step[..., 1:, :]
        moves = _FUTURE_MOVES[going] @ self._moving
        self._turning[..., 2] = self._wanted_facing(command.heading)
        self._turning[..., :2] = self._turning @ _STEP_TURN.T
        turns = self._turning @ _FUTURE_TURNS.T
        self.desired[..., _PLACE] = self.simulated[..., None, :] + moves[..., : len(FUTURE), :]
        self.desired[..., _FACING] = turns[..., 1 : len(_NOW_AND_AHEAD)]
        gaits = label_gait(moves[..., len(FUTURE) :, :], turns[..., len(_NOW_AND_AHEAD) :])
        self.gait = gaits[..., 0, :]
        return gaits[..., 1:, :]

    def _wanted_facing(self, heading: np.ndarray) -> np.ndarray:
        """The yaw asked for, by the way from the simulated facing that is shorter; without a wish, the present one."""
        facing = self._turning[..., 0]
        has_heading = rot.length(heading)[..., 0] >= 1e-3
        return facing + rot.wrap_angle(rot.yaw_of(heading) - facing) * has_heading

    def _limit_lead(self) -> None:
        """The simulated body waits where the character cannot keep up with it, and comes back to it once it stands."""
        kept = 1 - self.standing * (1 - decay(STANDING_HALFLIFE, DT))
        self.simulated = self.position + limit_length((self.simulated - self.position) * kept[..., None], MAX_LEAD)
        turn = self._turning[..., 0] - self.facing
        self._turning[..., 0] = self.facing + np.minimum(np.maximum(turn, -MAX_FACING_LEAD), MAX_FACING_LEAD)


def rotate_2d(vectors: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Vectors (..., n, 2) over the floor, x and z, turned about the vertical by yaws (...) in radians."""
    sine, cosine = np.sin(yaw), np.cos(yaw)
    return vectors @ np.array([[cosine, sine], [-sine, cosine]]).T  # the transpose brings a crowd's axis to the front
