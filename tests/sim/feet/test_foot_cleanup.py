"""The feet of a restyled clip: they slide no more than the content's, stay over the floor, and an untouched clip is
untouched."""

import numpy as np

from sim.body.limb_ik import LEGS
from sim.body.pose import Pose
from sim.body.skeleton import CONTACT_JOINTS, INDEX, TOE_HEIGHT, TOES
from sim.feet.foot_cleanup import clean_feet
from sim.math import rotations as rot
from sim.motion.clip import root_frame
from sim.motion.contacts import foot_contacts
from tests.support.walker import planted_clip, walking_clip


def as_pose(clip, contacts=None):
    root = root_frame(clip.positions())
    contacts = foot_contacts(clip) if contacts is None else contacts
    return Pose(root.positions, root.facing, clip.hips, clip.global_rotations(), contacts, 0.0)


def wobbling(pose, degrees=12.0):
    """The pose with thighs swaying sideways and knees bent, as no planted foot can bear."""
    frames = np.arange(len(pose.hips))
    rotations = pose.rotations.copy()
    sway = rot.from_axis_angle(np.array([0.0, 0, 1]), np.radians(degrees) * np.sin(frames / 7))
    bend = rot.from_axis_angle(np.array([1.0, 0, 0]), np.full(len(frames), 0.35))
    for name, turn in (("UpLeg", sway), ("Leg", bend)):
        for side in ("Left", "Right"):
            rotations[:, INDEX[side + name]] = rot.multiply(turn, rotations[:, INDEX[side + name]])
    return pose.with_body(pose.hips, rotations)


def test_an_untouched_clip_is_untouched():
    pose = as_pose(walking_clip())
    assert clean_feet(pose, pose) is pose


def test_planted_feet_stand_still_on_the_floor():
    standing = as_pose(planted_clip(), np.ones((120, 4)))
    wild = wobbling(standing)
    calm = clean_feet(wild, standing)

    def drift(pose):
        return np.ptp(pose.positions[10:-10, CONTACT_JOINTS[::2]], axis=0).max()

    assert drift(wild) > 0.15 and drift(calm) < 0.012
    heights = calm.positions[10:-10, TOES, 1]
    assert np.abs(heights - TOE_HEIGHT).max() < 0.02
    assert calm.hips[60, 1] < standing.hips[60, 1] - 0.005, "bent knees lower the body, not lift the feet"


def test_walking_feet_slide_no_more_than_the_contents_and_bones_keep_their_length():
    walk = walking_clip()
    contacts = np.zeros((len(walk), 4))
    phase = 2 * np.pi * np.arange(len(walk)) / 60
    contacts[:, :2], contacts[:, 2:] = (np.cos(phase) < -0.2)[:, None], (np.cos(phase) > 0.2)[:, None]
    content = as_pose(walk, contacts)
    styled = wobbling(content, 8.0)
    cleaned = clean_feet(styled, content)

    def slide(pose):
        """Speed of planted ankles beside the content's own, m/s."""
        apart = np.diff((pose.positions - content.positions)[:, CONTACT_JOINTS[::2]][..., [0, 2]], axis=0) * 60
        planted = np.minimum(contacts[1:, ::2], contacts[:-1, ::2]) > 0
        return np.linalg.norm(apart, axis=-1)[planted].mean()

    assert slide(cleaned) < 0.25 * slide(styled)
    for upper, lower in zip(LEGS[:-1], LEGS[1:]):
        lengths = np.linalg.norm(cleaned.positions[:, upper] - cleaned.positions[:, lower], axis=-1)
        assert np.ptp(lengths) < 1e-9
    assert np.abs(np.diff(cleaned.positions, 3, axis=0)).max() < 0.015, (
        "no pops, though these legs are straight as they land"
    )
