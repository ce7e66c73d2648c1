"""Keeps planted feet where they stand and every foot above the floor."""

from sim.pose import Pose


class FootLock:
    """Placeholder until the stylizer runs: passes the styled pose through."""

    def step(self, styled: Pose, neutral: Pose) -> Pose:
        return styled
