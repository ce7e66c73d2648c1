"""The graphs of one frame, recorded from the code that runs (demo.export.onnx_recorder): pace, controller, stylizer,
feet.

What one frame hands to the next is one flat input `state` and one flat output `next_state` of each graph. Places are
told from the root's own, which the player adds up in double precision: so nothing loses precision far from the origin.
"""

import copy
from types import SimpleNamespace
from typing import Any

import numpy as np

from controller.model.idle_layer import SECONDS as IDLE_SECONDS
from controller.model.network import CONTROL_POINTS
from controller.model.phase_table import PhaseTable
from controller.runtime.controller import PhaseFunctionedController
from controller.runtime.playback import CATCH_UP, Playback
from demo.export.onnx_recorder import recording
from demo.export.onnx_state import Ask, Kept, Made, State, moved_poses, over_floor
from demo.export.onnx_styles import StyleTable, record_styling
from sim.body.kinematics import to_local
from sim.body.pose import FLAT_SIZE, Pose
from sim.command import Command
from sim.feet.foot_lock import FootLock
from sim.hands.hand_clearance import HandClearance
from sim.math.vectors import NOT_YET, before_or_now
from sim.motion.clip import FPS
from sim.motion.feature_window import SPAN, RingBuffer
from sim.motion.features import STRIDE
from sim.motion.playback_pace import OWN_PACE, Pace, PaceFollower

MOST_ADVANCES = 2  # frames of the controller in one of the player's
TURN = 2 * np.pi


class _Network:
    """The controller's network: its four control points' outputs blended, as for a crowd."""

    def __init__(self, table: PhaseTable) -> None:
        self.table = table
        layers: Any = table.network.layers
        self.layers = [
            (layer.weight.detach().numpy().T, layer.bias.detach().numpy())  # (inputs, 4 outputs)
            for layer in layers
        ]

    def __call__(self, x: Any, phase: Any) -> Any:
        table = self.table
        place = phase * (table.entries / TURN)
        entry = np.floor(place)
        share, entry = place - entry, entry % table.entries
        near, far = (np.take(table.coefficients, entry + beside, axis=0) for beside in (0.0, 1.0))
        blend = near + share * (far - near)
        h = (x - table.mean) / table.deviation
        for i, (weight, bias) in enumerate(self.layers):
            h = np.maximum(h, np.exp(np.minimum(h, 0.0)) - 1) if i else h
            four = h[None] @ weight + bias
            h = (blend[None] @ four.reshape(CONTROL_POINTS, -1))[0]
        return h * table.output_deviation + table.output_mean


def record_pace(double: bool) -> Made:
    """How fast the controller is to go and how many of its frames are due."""
    follower, playback = PaceFollower(), Playback()
    state = State(
        [
            Kept(follower, "pace", "speed and playback rate on their way to those that are asked"),
            Kept(follower, "change", "how fast they change, 1/s"),
            Kept(playback, "clock", "0..1 from the last pose of the controller but one to the last"),
        ],
        lambda: follower.step(1.0, 1.0),
    )
    with recording(double) as graph:
        paces, gait = graph.input("paces", np.ones((3, 2))), graph.input("gait", 0.0)
        follow, stride = graph.input("follow", 0.0), graph.input("stride", 1.0)
        state.read(graph)
        speed, rate = np.take(paces, gait, axis=0)
        followed = follow > 0.5
        speed, rate = follower.step(np.where(followed, speed, 1 / stride), np.where(followed, rate, 1.0))
        clock, advances = playback.clock, np.zeros(())
        clock = clock + np.where(rate == 1, np.minimum(1 + CATCH_UP, 2 - clock), rate)
        for _ in range(MOST_ADVANCES):
            due = (clock > 1).astype("f")
            clock, advances = clock - due, advances + due
        playback.clock = clock
        graph.output("pace", np.stack([speed, rate, stride]))
        graph.output("advances", advances)
        graph.output("clock", clock)
        state.write(graph)
    return Made(graph, state, record_pace.__doc__ or "")


def record_controller(controller: PhaseFunctionedController, uneven: bool, double: bool) -> Made:
    """One frame of the controller: the command becomes the next neutral pose."""
    one = copy.copy(controller)
    one.ground = None
    one.restart()
    memory = SimpleNamespace(poses=NOT_YET)
    way, jump = one.trajectory, one.trajectory.jump

    def step() -> None:
        memory.poses = np.array([one._advance(Command(), OWN_PACE).flat] * 3)

    state = State(
        [
            Kept(way, "facing", "of the root, radians"),
            Kept(way, "past", "of the last second, the newest last: x, z, yaw, weights of the gaits, lift of a jump"),
            Kept(way, "predicted", "what the network expects at the samples to come: x, z, yaw"),
            Kept(way, "simulated", "place of the body that the stick drives, m"),
            Kept(way, "_moving", "its velocity, acceleration and wanted velocity, m/s"),
            Kept(way, "_turning", "its facing, turn rate and wanted facing, radians"),
            Kept(way, "_crouching", "how far it crouches, how fast that changes, how far it is asked to"),
            Kept(way, "gait", "its weights of the gaits"),
            Kept(jump, "time", "seconds since the take-off, -1000 for none"),
            Kept(jump, "waiting", "1 where a jump is pressed and not begun"),
            Kept(one.root_correction, "feet", "places of ankles and toes in the last frame, m, in the root's frame"),
            Kept(one.root_correction, "slide", "what planted feet slide in a frame, m"),
            Kept(one.wrists, "turned", "hands against their forearms, quaternions"),
            Kept(one.idle, "frame", "of the idle's loop"),
            Kept(one.idle, "easing", "of its sway and its bearing: share, how fast that changes, wanted share"),
            Kept(one, "phase", "of the stride, radians"),
            Kept(one, "body", "positions and velocities that the network sees next, m, m/s, in the root's frame"),
            Kept(memory, "poses", "the last three, as `poses`"),
        ],
        step,
    )
    with recording(double) as graph:
        command = SimpleNamespace(
            desired_velocity=graph.input("desired_velocity", np.zeros(2)),
            heading=graph.input("heading", np.zeros(2)),
            crouch=graph.input("crouch", 0.0),
            jump=graph.input("jump", 0.0) > 0.5,
        )
        pace = Pace(*graph.input("pace", np.ones(3)))
        one.network = _Network(controller.network)  # type: ignore[assignment]
        state.read(graph)
        way.ground = Ask(graph) if uneven else None  # type: ignore[assignment]
        way.position, way.desired = np.zeros((2,)), np.zeros(way.predicted.shape)
        pose = one._advance(command, pace).flat  # type: ignore[arg-type]
        moved = way.position
        way.translate(-1.0 * moved)
        _wrap(way)
        one.idle.frame = one.idle.frame % (IDLE_SECONDS * FPS)
        pose = moved_poses(pose, moved)
        before = before_or_now(moved_poses(memory.poses, moved), pose)
        memory.poses = np.stack([before[1], before[2], pose])
        graph.output("moved", moved)
        graph.output("poses", memory.poses)
        graph.output("predicted", way.predicted)
        state.write(graph)
    return Made(graph, state, record_controller.__doc__ or "")


def _wrap(way: Any) -> None:
    """Facings are told about the present one in -pi .. pi, all of them alike."""
    shift = TURN * np.floor(way.facing / TURN + 0.5)
    way.facing = way.facing - shift
    for facings in (way.past[..., 2], way.predicted[..., 2], way._turning[::2]):
        facings -= shift


def record_stylizer(table: StyleTable, double: bool) -> Made:
    """The newest neutral pose and that pose restyled."""
    history = RingBuffer()
    memory = SimpleNamespace(features=NOT_YET, poses=NOT_YET)  # of the frames before
    styling = record_styling(table)

    def step() -> None:
        memory.poses = np.full((STRIDE, FLAT_SIZE), np.nan)
        memory.features = np.full((SPAN - 1, 21, 15), np.nan)

    state = State(
        [
            Kept(memory, "features", "of the last half second, without the newest, oldest first"),
            Kept(memory, "poses", "the neutral poses of the last two frames, as `neutral`"),
            *(Kept(owner, name, meaning) for owner, name, meaning in styling.kept),
        ],
        step,
    )
    with recording(double) as graph:
        poses: Any = graph.input("poses", np.zeros((3, FLAT_SIZE)))
        clock: Any = graph.input("clock", 1.0)
        heights, moved = graph.input("root_heights", np.zeros(3)), graph.input("moved", np.zeros(2))
        pace, request = Pace(*graph.input("pace", np.ones(3))), graph.input("request", np.full((5, 4), -1.0))
        state.read(graph)
        raised = poses.copy()
        for y in (1, 5):
            raised[:, y] = raised[:, y] + heights
        playback = Playback()
        playback.clock, playback._last = clock, raised
        neutral = playback.pose()
        flat = neutral.flat
        before = before_or_now(moved_poses(memory.poses, moved), flat)
        history._poses.extend(Pose.of_flat(pose) for pose in before)
        history._features.extend(memory.features)
        history.push(neutral, pace)
        newest = history._features[-1]
        features = [before_or_now(each, newest) for each in memory.features] + [newest]
        history._features.extend(features)
        memory.features, memory.poses = np.stack(features[1:]), np.stack([before[1], flat])
        styled = styling.step(history.window(), neutral, request, pace.travel)
        graph.output("neutral", flat)
        graph.output("neutral_positions", neutral.positions)
        graph.output("styled", styled.flat)
        graph.output("legs", styling.leg_strengths())
        graph.output("paces", styling.paces())
        state.write(graph)
    return Made(graph, state, record_stylizer.__doc__ or "")


def record_feet(uneven: bool, double: bool) -> Made:
    """The styled pose with its feet and its hands in order: what is drawn."""
    lock, clearance = FootLock(), HandClearance()
    slip, settling, attitude, stride = lock.slip, lock.settling, lock.attitude, lock.stride
    standing = Pose(np.zeros(3), 0.0, np.array([0, 1.0, 0]), np.tile([1.0, 0, 0, 0], (21, 1)), np.ones(4), 0.0)
    state = State(
        [
            Kept(lock, "joints", "ankles and toes of the last frame, left and right, m"),
            Kept(lock, "soles", "height of the ground under them, m"),
            Kept(lock, "landed", "how far each foot was down, 0..1"),
            Kept(slip, "vectors", "what each foot is held back, m"),
            Kept(slip, "rates", "how fast that changes, m/s"),
            Kept(lock, "height", "what each foot is raised, m"),
            Kept(lock, "height_rate", "m/s"),
            Kept(lock, "rise", "what the body is raised, m"),
            Kept(lock, "rise_rate", "m/s"),
            Kept(lock, "drop", "what the hips sink to let legs reach, m"),
            Kept(lock, "drop_rate", "m/s"),
            Kept(settling, "standing", "seconds that both feet have been planted"),
            Kept(settling, "left", "seconds that each foot's settling step still takes"),
            Kept(attitude, "foot", "from ankle to toe in the last frame, m"),
            Kept(attitude.turned, "vectors", "what each toe is held back, m"),
            Kept(attitude.turned, "rates", "m/s"),
            Kept(attitude, "tilt", "what each toe is raised to lie on the ground, m"),
            Kept(attitude, "tilt_rate", "m/s"),
            Kept(stride, "_before", "the root's place in the last frame, m"),
            Kept(stride, "_velocity", "of the root, m/s, in its own frame"),
            Kept(stride, "_mean", "styled and neutral feet along the way, on the average, m"),
            Kept(stride, "_products", "of their swings, square metres"),
            Kept(clearance, "held", "what elbow and wrist of each arm are held out of the body, m"),
            Kept(clearance, "way", "the same as it is drawn, m"),
            Kept(clearance, "rate", "how fast that changes, m/s"),
        ],
        lambda: clearance.step(lock.step(standing, standing)),
    )
    with recording(double) as graph:
        poses: tuple[Any, ...] = tuple(graph.input(name, standing.flat) for name in ("neutral", "styled"))
        neutral, styled = map(Pose.of_flat, poses)
        legs: Any = graph.input("legs", np.zeros(2))
        moved = graph.input("moved", np.zeros(2))
        follow: Any = graph.input("follow", 0.0) > 0.5
        state.read(graph)
        lock.joints, stride._before = (each - over_floor(moved) for each in (lock.joints, stride._before))
        lock.ground = Ask(graph) if uneven else None  # type: ignore[assignment]
        pose = clearance.step(lock.step(styled, neutral, legs, follow))
        graph.output("positions", pose.positions)
        graph.output("rotations", pose.rotations)
        graph.output("local_rotations", to_local(pose.rotations))
        graph.output("root_position", pose.root_position)
        graph.output("root_facing", np.asarray(pose.root_facing))
        graph.output("contacts", pose.contacts)
        graph.output("phase", np.asarray(pose.phase))
        graph.output("stride", stride.scale)
        state.write(graph)
    return Made(graph, state, record_feet.__doc__ or "")
