"""The style-transfer systems: one record for each, with its networks and what it can do."""

from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from types import ModuleType
from typing import Any, Mapping

from sim.io.bvh_parser import shorten


class GlobalMotion(Enum):
    """What a system does to the root motion of a whole clip."""

    KEPT = "the content's is kept"
    WARPED = "time is warped by the style's speed (Aberman et al. 2020, Eq. 2)"
    PREDICTED = "the root velocity is read from the restyled local motion (Guo et al. 2024, Sec. 3.2.3)"


@dataclass(frozen=True)
class System:
    """kind: what the header of a weight file calls it; module, model: where its class is, under stylizer.systems;
    configs: the module that holds the settings of its networks, in a table CONFIGS; networks: their names."""

    kind: str
    module: str
    model: str
    configs: str
    networks: tuple[str, ...]
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
            ("full", "paper_slim", "paper_narrow", "large", "slim", "slim_no_attention", "slim_whole_body_adain"),
            by_part=True,
            has_attention=True,
        ),
        System(
            "motion-puzzle-joints",
            "motion_puzzle.joint_model",
            "JointPuzzle",
            "motion_puzzle.joint_config",
            ("joints", "joints_half_second", "joints_no_attention", "joints_whole_body_adain"),
            by_part=True,
            has_attention=True,
        ),
        System(
            "unpaired",
            "unpaired",
            "Unpaired",
            "unpaired",
            ("unpaired",),
            reads_key_points=True,
            global_motion=GlobalMotion.WARPED,
        ),
        System(
            "diverse",
            "diverse",
            "Diverse",
            "diverse",
            ("diverse", "diverse_full"),
            samples_styles=True,
        ),
        System(
            "latent",
            "latent",
            "Latent",
            "latent",
            ("latent", "latent_unlabelled", "latent_vae"),
            samples_styles=True,
            global_motion=GlobalMotion.PREDICTED,
        ),
    )
}


def all_networks() -> dict[str, System]:
    """Network name -> its system."""
    return {network: system for system in SYSTEMS.values() for network in system.networks}


def system_of_network(network: str) -> System:
    """The system of a network by its name. Raises ValueError for an unknown one."""
    if network not in all_networks():
        raise ValueError(f"there is no network '{shorten(network)}': use one of {', '.join(all_networks())}")
    return all_networks()[network]
