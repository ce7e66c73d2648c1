"""The trajectory: where the root was, is, and should be, from the stick's wish and the network's own expectation."""

import numpy as np

from controller.model.gait_phase import TURN_RADIUS, label_gait
from controller.model.io_layout import FUTURE, GAITS, OFFSETS, SAMPLE_STEP, SIDES
from controller.runtime.jump import Jump
from sim.command import Command, Commands
from sim.ground.ground import Ground
from sim.math import rotations as rot
from sim.math.easing import ramp
from sim.math.springs import decay, response, spring_step, spring_travel
from sim.math.vectors import limit_length
from sim.motion.clip import FPS
from sim.motion.thresholds import STANDING_STEP

DT = 1 / FPS
VELOCITY_HALFLIFE, STOP_HALFLIFE = 0.14, 0.12  # seconds, while the stick asks for movement and when it is let go
FACING_HALFLIFE = 0.16  # seconds
CROUCH_HALFLIFE = 0.15  # seconds, down and up
# Share of the speed that a rise, and a fall, of a metre in a metre takes: the speed is divided by 1 + this.
UPHILL, DOWNHILL = 1.0, 0.5
MAX_LEAD = 0.15  # metres that the simulated body may be ahead of the character
MAX_FACING_LEAD = np.pi / 2
STANDING_HALFLIFE = 0.2  # seconds in which a standing character's simulated body gives up half of its lead
# tau of the blend 1 - (1 - u)^tau, u seconds ahead, from the network's own future to the wish (Holden et al. 2017)
POSITION_BIAS, FACING_BIAS = 2.0, 3.0
_PAST = -OFFSETS[0]  # frames of history
_AHEAD = np.array(FUTURE) * DT  # seconds
_NOW_AND_AHEAD = np.append(0.0, _AHEAD)
_TOWARD_DESIRED = 1 - (1 - _AHEAD[:, None]) ** np.array([POSITION_BIAS, POSITION_BIAS, FACING_BIAS])
# Columns of a root's row: x, z, yaw, gait weights, metres that a jump lifts it.
_PLACE, _FACING, _GAIT, _LIFT = slice(0, 2), 2, slice(3, 3 + len(GAITS)), 3 + len(GAITS)
_CROUCH, _JUMP = (_GAIT.start + GAITS.index(name) for name in ("crouch", "jump"))
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
_STEP_CROUCH = response(spring_step, CROUCH_HALFLIFE, DT)
_FUTURE_CROUCHES = response(spring_step, CROUCH_HALFLIFE, _AHEAD)[: len(_AHEAD)]
_BESIDE = np.array(SIDES)[:, None]


class Trajectory:
    """The root, a second of its past, its expected future, and the simulated body that the stick drives by springs.

    Positions (..., 2) are world x, z in metres; facings (...) are yaw in radians, never wrapped. The leading axes are
    those of a crowd: none for one character."""

    STATE = (
        "position",
        "facing",
        "past",
        "predicted",
        "desired",
        "simulated",
        "_moving",
        "_turning",
        "_crouching",
        "gait",
        "jump",
    )

    def __init__(self, crowd: tuple[int, ...] = (), ground: Ground | None = None) -> None:
        """ground: None for level floor."""
        self.ground = ground
        self.position, self.facing = np.zeros((*crowd, 2)), np.zeros(crowd)
        self.past = np.zeros((*crowd, _PAST + 1, _LIFT + 1))  # rows of the root, oldest first, the present last
        self.past[..., _GAIT] = label_gait(np.zeros(2), np.zeros(()))
        # x, z, yaw at the samples to come: what the network expects, and the last wish, what the stick asks by springs
        # alone.
        self.predicted, self.desired = np.zeros((2, *crowd, len(FUTURE), 3))
        self.simulated = np.zeros((*crowd, 2))
        self._moving = np.zeros((*crowd, 3, 2))  # of the simulated body: velocity, acceleration, wanted velocity
        self._turning = np.zeros((*crowd, 3))  # the same of its turning: facing, turn rate, wanted facing
        self._crouching = np.zeros((*crowd, 3))  # how far it crouches, how fast that changes, how far it is asked to
        self.jump = Jump(crowd)
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
    def wanted_velocity(self) -> np.ndarray:
        """(..., 2) that the simulated body is driven to, metres a second: what the stick asks, slowed on slopes."""
        return self._moving[..., 2, :].copy()

    @property
    def standing(self) -> np.ndarray:
        """(...) 0..1, by the gait of the newest frame: upright, and on the ground."""
        present = self.past[..., -1, :]
        on_ground = 1 - present[..., _JUMP]
        return present[..., _GAIT.start + GAITS.index("stand")] * self.upright * on_ground

    @property
    def upright(self) -> np.ndarray:
        """(...) 0..1, by the gait of the newest frame: not crouching."""
        return 1 - self.past[..., -1, _CROUCH]

    @property
    def height(self) -> np.ndarray:
        """(...) metres of the root: on the blurred ground, or carried over it by a jump."""
        lift = self.jump.lift()
        return lift if self.ground is None else lift + self.ground.smooth_height_at(self.position)

    def samples(self, command: Command | Commands, speed: np.ndarray | float = 1.0) -> dict[str, np.ndarray]:
        """Moves the simulated body by a frame; the network's trajectory input (controller.model.io_layout.INPUT) in the
        root frame. speed: what the desired velocity is multiplied by."""
        self.jump.press(command.jump)
        rows = np.zeros((*self.position.shape[:-1], len(OFFSETS), _LIFT + 1))
        rows[..., _PRESENT, :] = self.past[..., ::SAMPLE_STEP, :]
        rows[..., _FUTURE, _GAIT] = self._move_simulated(command, speed)
        rows[..., _FUTURE, _ROOT] = self.predicted + (self.desired - self.predicted) * _TOWARD_DESIRED
        if self.jump.under_way:
            rows[..., _FUTURE, _LIFT], rows[..., _FUTURE, _JUMP] = self.jump.lift(_AHEAD), self.jump.weight(_AHEAD)
        directions = _direction(rows[..., _FACING] - self.facing[..., None])
        places, heights = self._on_ground(rows)
        return {
            "trajectory_positions": places,
            "trajectory_heights": heights,
            "trajectory_directions": directions,
            "trajectory_gaits": rows[..., _GAIT],
        }

    def _on_ground(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (..., 12, 3) of rows in the root frame, and the ground (..., 12, SIDES) at and beside them, over the
        root."""
        places = np.empty((*rows.shape[:-1], 3))
        places[..., ::2] = rotate_2d(rows[..., _PLACE] - self.position[..., None, :], -self.facing)
        here = np.asarray(self.height)[..., None]
        if self.ground is None:
            places[..., 1] = rows[..., _LIFT] - here
            return places, np.broadcast_to(-here[..., None], (*rows.shape[:-1], len(SIDES)))
        places[..., 1] = self.ground.smooth_height_at(rows[..., _PLACE]) + rows[..., _LIFT] - here
        left = _direction(rows[..., _FACING])[..., ::-1] * (1.0, -1.0)
        beside = rows[..., None, _PLACE] + _BESIDE * left[..., None, :]
        return places, self.ground.height_at(beside) - here[..., None]

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
        self.jump.advance()
        self.past[..., :-1, :] = self.past[..., 1:, :]
        present = self.past[..., -1, :]
        present[..., _PLACE], present[..., _FACING], present[..., _GAIT] = self.position, self.facing, self.gait
        present[..., _LIFT] = self.jump.lift()
        self._limit_lead()

    def translate(self, shift: np.ndarray) -> None:
        """Moves everything by (..., 2) metres: the network sees no difference."""
        self.position = self.position + shift
        self.simulated = self.simulated + shift
        for places in (self.past, self.predicted, self.desired):
            places[..., _PLACE] += shift[..., None, :]

    def _move_simulated(self, command: Command | Commands, speed: np.ndarray | float) -> np.ndarray:
        """Moves the simulated body and predicts its future, `desired`; its gaits there (..., 5, GAITS). In the air it
        keeps the velocity and the facing that it took off with."""
        grounded = ~self.jump.airborne
        asked = command.desired_velocity
        wanted = np.asarray(speed)[..., None] * asked * self._slowing(asked)
        self._moving[..., 2, :] = np.where(grounded[..., None], wanted, self._moving[..., 2, :])
        going = self._moving[..., 2, :].any(axis=-1).astype(int)
        step = np.take(_STEP_MOVE, going, axis=0) @ self._moving
        self.simulated = self.simulated + step[..., 0, :]
        self._moving[..., :2, :] = step[..., 1:, :]
        moves = np.take(_FUTURE_MOVES, going, axis=0) @ self._moving
        self._turning[..., 2] = np.where(grounded, self._wanted_facing(command.heading), self._turning[..., 2])
        self._turning[..., :2] = self._turning @ _STEP_TURN.T
        turns = self._turning @ _FUTURE_TURNS.T
        self.desired[..., _PLACE] = self.simulated[..., None, :] + moves[..., : len(FUTURE), :]
        self.desired[..., _FACING] = turns[..., 1 : len(_NOW_AND_AHEAD)]
        gaits = label_gait(moves[..., len(FUTURE) :, :], turns[..., len(_NOW_AND_AHEAD) :])
        self._crouching[..., 2] = command.crouch
        crouches = self._crouching @ _FUTURE_CROUCHES.T
        self._crouching[..., :2] = self._crouching @ _STEP_CROUCH.T
        crouch = GAITS.index("crouch")
        gaits[..., 0, crouch], gaits[..., 1:, crouch] = self._crouching[..., 0], crouches
        gaits[..., 0, GAITS.index("jump")] = self.jump.weight()
        self.gait = gaits[..., 0, :]
        return gaits[..., 1:, :]

    def _slowing(self, velocity: np.ndarray) -> np.ndarray | float:
        """The share (..., 1) of a velocity (..., 2) that is left on a slope."""
        if self.ground is None:
            return 1.0
        way = velocity / np.maximum(rot.length(velocity), 1e-6)
        rise = np.vecdot(self.ground.slope_at(self.position), way)[..., None]
        return 1 / (1 + np.where(rise > 0, UPHILL, -DOWNHILL) * rise)

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


def _direction(yaw: np.ndarray) -> np.ndarray:
    """(..., 2) the unit vectors of yaws (...), x and z."""
    result = np.empty((*yaw.shape, 2))
    result[..., 0], result[..., 1] = np.sin(yaw), np.cos(yaw)
    return result


def rotate_2d(vectors: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Vectors (..., n, 2) over the floor, x and z, turned about the vertical by yaws (...) in radians."""
    sine, cosine = np.sin(yaw), np.cos(yaw)
    return vectors @ np.array([[cosine, sine], [-sine, cosine]]).T  # the transpose brings a crowd's axis to the front
