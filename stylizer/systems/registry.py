"""The style-transfer systems: one record for each, with its networks and what it can do."""

from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from types import ModuleType
from typing import Any, Mapping


class GlobalMotion(Enum):
    """What a system does to the root motion of a whole clip."""

    KEPT = "the content's is kept"
    WARPED = "time is warped by the style's speed (Aberman et al. 2020, Eq. 2)"
    PREDICTED = "the root velocity is read from the restyled local motion (Guo et al. 2024, Sec. 3.2.3)"


@dataclass(frozen=True)
class System:
    """kind: what the header of a weight file calls it; module, model: where its class is, under stylizer.systems;
    configs: the module that names its networks, in a table CONFIGS."""

    kind: str
    module: str
    model: str
    configs: str
    by_part: bool = False  # styles go into the network part by part; False: one code for the whole body
    has_attention: bool = False
    samples_styles: bool = False  # styles are also sampled from a prior, without a clip
    reads_key_points: bool = False  # styles are also read from a video's key points
    global_motion: GlobalMotion = GlobalMotion.KEPT

    def load_class(self) -> Any:
        """The network's class, imported when it is wanted."""
        return getattr(import_module(f"stylizer.systems.{self.module}"), self.model)

    def load_training(self) -> ModuleType:
        """The module with the RECIPE and the Objective of a whole-body system."""
        return import_module(f"stylizer.systems.{self.module}")

    def load_configs(self) -> Mapping[str, Any]:
        """The configurations of its networks by name, without labels yet."""
        return import_module(f"stylizer.systems.{self.configs}").CONFIGS


SYSTEMS = {
    system.kind: system
    for system in (
        System(
            "motion-puzzle",
            "motion_puzzle.model",
            "MotionPuzzle",
            "motion_puzzle.config",
            by_part=True,
            has_attention=True,
        ),
        System(
            "motion-puzzle-joints",
            "motion_puzzle.joint_model",
            "JointPuzzle",
            "motion_puzzle.joint_config",
            by_part=True,
            has_attention=True,
        ),
        System(
            "unpaired",
            "unpaired",
            "Unpaired",
            "unpaired",
            reads_key_points=True,
            global_motion=GlobalMotion.WARPED,
        ),
        System(
            "diverse",
            "diverse",
            "Diverse",
            "diverse",
            samples_styles=True,
        ),
        System(
            "latent",
            "latent",
            "Latent",
            "latent",
            samples_styles=True,
            global_motion=GlobalMotion.PREDICTED,
        ),
    )
}


def all_networks() -> dict[str, System]:
    """Network name -> its system; the module of every system is imported."""
    return {network: system for system in SYSTEMS.values() for network in system.load_configs()}
