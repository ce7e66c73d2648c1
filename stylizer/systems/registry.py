"""The three whole-body systems by the names that training, weight files and `--stylizer` know."""

from importlib import import_module
from types import ModuleType

# network -> (module beside this one, the name of its configuration there)
NETWORKS = {
    "unpaired": ("unpaired", "CONFIG"),
    "diverse": ("diverse", "CONFIG"),
    "diverse_full": ("diverse", "FULL"),
    "latent": ("latent", "CONFIG"),
    "latent_unlabelled": ("latent", "UNLABELLED"),
    "latent_vae": ("latent", "VARIATIONAL"),
}


def module(network: str) -> ModuleType:
    """The file of a system: its CONFIG, RECIPE and Objective."""
    return import_module(f"stylizer.systems.{NETWORKS[network][0]}")


def config(network: str):
    """The configuration of a network, without labels yet."""
    return getattr(module(network), NETWORKS[network][1])
