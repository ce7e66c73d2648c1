"""Training of Motion Puzzle at the resolution of joints."""

from stylizer.data.dataset import MotionData
from stylizer.data.joint_sampler import JointSampler
from stylizer.systems.motion_puzzle.joint_config import CONFIGS, JointConfig
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.joint_objective import RECIPE, JointInputs, JointObjective
from stylizer.training.trainer import Trainer


class JointTrainer(Trainer):
    """A `Trainer` of a network of stylizer.systems.motion_puzzle.joint_config.CONFIGS."""

    SAMPLER, INPUTS, OBJECTIVE = JointSampler, JointInputs, JointObjective
    AUTOCASTS = False

    def __init__(self, data: MotionData, network: str, seed: int = 1) -> None:
        super().__init__(data, CONFIGS[network], RECIPE, seed)

    def _build(self, config: JointConfig) -> JointPuzzle:
        return JointPuzzle(config)
