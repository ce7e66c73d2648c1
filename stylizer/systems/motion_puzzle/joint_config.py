"""Motion Puzzle at the resolution of joints: its settings, and what each ablation takes away.

The names of `CONFIGS` are what training, evaluation and bench know."""

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class JointConfig:
    lags: tuple[int, ...] = (0,)  # samples back, at 30 Hz, at which a query sees the body: the newest pose alone
    hidden: int = 160  # units between the body and its code
    code: int = 32  # size of queries and keys
    sharpness: float = 8.0  # score of a query that equals a key; sharper attention jumps from step to step
    attention: bool = True  # BP-ATN; False: BP-AdaIN alone, which scales the content's own movement
    by_part: bool = True  # BP-AdaIN; False: one shift for all joints of the body (Sec. 7.2)


JOINT_PUZZLE = JointConfig()
CONFIGS = {
    "joints": JOINT_PUZZLE,
    "joints_half_second": replace(JOINT_PUZZLE, lags=(0, 3, 6, 9, 12, 15)),
    "joints_no_attention": replace(JOINT_PUZZLE, attention=False),
    "joints_whole_body_adain": replace(JOINT_PUZZLE, by_part=False),
}
