"""The second lesson of a whole-body system: to give the newest pose of a live window as if it saw what comes next.

These systems look ahead as well as back. Live there is nothing ahead, so a window ends with its newest sample held
(`WholeBody.live_samples`), which they never saw while they learned their style: a third of it gets lost. Here the
trained network teaches itself. What it gives where it sees the future, it learns to give where it does not."""

import copy
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn

from stylizer.data.dataset import MotionData
from stylizer.data.domains import DomainBatch, label_of
from stylizer.systems import checkpoint
from stylizer.systems.motion_puzzle.objective import Recipe
from stylizer.systems.registry import system_of_network
from stylizer.systems.whole_body import Restyled, WholeBody
from stylizer.training.train_systems import SystemTrainer

# newest: of the pose that is drawn live; window: of whole windows, which must not change. Both mean distances of the
# joints' axes, and of the hips in metres.
RECIPE = Recipe({"newest": 1.0, "window": 0.5}, batch=16, learning_rate=3e-4, momentum=0.9, average=0.998)
REMEDY = "name others with --start"


class LiveObjective(nn.Module):
    """How far a system is from its own teacher, a copy of it that stays as it was."""

    PHASES = ("live",)

    def __init__(self, system: WholeBody) -> None:
        super().__init__()
        self.system = system
        self.teacher = copy.deepcopy(system).requires_grad_(False)
        self.live = system.live_samples()

    def learned(self) -> dict[str, list[tuple[list[nn.Parameter], float]]]:
        """All but what codes are made of: a style keeps its code."""
        fixed = {id(parameter) for parameter in code_parameters(self.system)}
        return {"live": [([p for p in self.system.parameters() if id(p) not in fixed], 1.0)]}

    def schedule(self, progress: float) -> tuple[tuple[str, ...], float]:
        """The one phase and how far it is."""
        return self.PHASES, progress

    def forward(self, phase: str, x: DomainBatch[Tensor], step: int) -> dict[str, Tensor]:
        """The terms of RECIPE, of sources in the styles of targets and in their own."""
        newest = self.system.newest
        with torch.no_grad():
            shown = torch.cat([x.target, x.kin], dim=1)
            codes = self.teacher.encode(shown, torch.cat([x.target_domain, x.source_domain]))
            wanted = self.teacher.restyled(x.source, codes)
        live = self.system.restyled(x.source[:, :, self.live], codes)
        return {
            "newest": distance(live, wanted, slice(newest, newest + 1)),
            "window": distance(self.system.restyled(x.source, codes), wanted, slice(None)),
        }


class LiveTrainer(SystemTrainer):
    """A `SystemTrainer` of a network that is trained already. Raises ValueError where `start` holds another one, and
    where none of the data has a label that it was taught."""

    def __init__(self, data: MotionData, network: str, start: Path, seed: int = 1) -> None:
        self.start = start
        super().__init__(data, network, seed)

    def _begin(self, data: MotionData, network: str, seed: int) -> tuple[Recipe, LiveObjective]:
        model, fingerprint = load_start(self.start, network)
        if not any(label_of(clip.name) in model.config.labels for clip in data.clips):
            raise ValueError(
                f"no clip to learn from has a style label that {self.start} was taught: "
                "unpack bandai-namco into the data folder"
            )
        self.origin = {"started_from": fingerprint}
        return RECIPE, LiveObjective(model)


def load_start(path: Path, network: str) -> tuple[WholeBody, str]:
    """A trained network and the fingerprint of its weight file. Raises ValueError where the file is damaged, or holds
    other weights than the network's."""
    model, fingerprint = checkpoint.load_file(path, REMEDY)
    system = system_of_network(network)
    if model.KIND != system.kind:
        raise ValueError(f"{path} holds weights of {model.KIND}, not of {system.kind}: {REMEDY}")
    if model.config != replace(system.load_configs()[network], labels=model.config.labels):
        raise ValueError(f"{path} holds weights of {system.kind} with other settings than {network} has: {REMEDY}")
    return model, fingerprint


def distance(given: Restyled, wanted: Restyled, samples: slice) -> Tensor:
    """Mean absolute difference over samples of a window, of axes and of hips where there are any."""
    pairs = ((a, b) for a, b in zip(given, wanted) if a is not None and b is not None)
    return sum(((a[:, :, samples] - b[:, :, samples]).abs().mean() for a, b in pairs), torch.zeros(()))


def code_parameters(system: WholeBody) -> list[nn.Parameter]:
    """The parameters that a clip's code depends on."""
    parameters = list(system.parameters())
    code = system.encode(torch.zeros(21, 1, system.config.window, 15), torch.zeros(1, dtype=torch.long))
    gradients = torch.autograd.grad(code.sum(), parameters, allow_unused=True)
    return [parameter for parameter, gradient in zip(parameters, gradients) if gradient is not None]
