"""One training run of Motion Puzzle: the network, its objective and optimiser, step by step, kept and resumed."""

import csv
import math
import time
from dataclasses import fields
from pathlib import Path
from typing import Any, Mapping

import numpy as np
import torch
from torch import distributed, nn

from sim.body.skeleton import PARTS
from sim.io.atomic_write import atomic_write
from sim.io.provenance import commit, credit
from sim.torch_setup import set_up_torch
from stylizer.data.dataset import MotionData
from stylizer.data.sampler import Batch, Sampler, measure_statistics
from stylizer.networks.layers import of_kind
from stylizer.networks.normalization import Scaled
from stylizer.systems import checkpoint
from stylizer.systems.motion_puzzle.model import MotionPuzzle
from stylizer.systems.motion_puzzle.objective import OURS, Inputs, Recipe, compute_losses
from stylizer.training.distributed import share_first

DECAY_FROM = 0.5  # share of the time after which the learning rate falls along a cosine, to FINAL_RATE of it
FINAL_RATE = 0.02
SECOND_MOMENT = 0.99  # beta_2 of RAdam
MIXING = 0.5  # probability that some parts keep the source's style (gamma of Alg. 1)
LOG_EVERY = 50  # steps
HELD_OUT_BATCHES = 8


class Objective(nn.Module):
    """The losses as a module's forward pass, which is what DistributedDataParallel averages the gradients of."""

    def __init__(self, model: MotionPuzzle, recipe: Recipe) -> None:
        super().__init__()
        self.model, self.recipe = model, recipe

    def forward(self, inputs: Inputs, late: bool) -> dict[str, torch.Tensor]:
        return compute_losses(self.model, inputs, self.recipe, late)


class Trainer:
    """Network, its running average, optimiser, random numbers and clock: everything that a resumed run needs."""

    KEPT = ("model", "average", "optimizer")  # whose state a checkpoint holds
    SAMPLER: type[Sampler] = Sampler
    INPUTS: type = Inputs  # of a batch, normalized, and of the parts that take the target's style
    OBJECTIVE: type[nn.Module] = Objective
    origin: Mapping[str, str] = {}  # what else a weight file's header says of where it comes from
    AUTOCASTS = True  # whether losses are computed in bf16 where that is fast
    model: Scaled
    objective: nn.Module
    optimizer: torch.optim.Optimizer

    def __init__(self, data: MotionData, config: Any, recipe: Recipe = OURS, seed: int = 1) -> None:
        torch.manual_seed(seed)
        set_up_torch(one_thread=False)
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.half = self.AUTOCASTS and has_fast_bf16(self.device)
        self.recipe = recipe
        learned_from = data.split(held_out=False)
        self.sampler = self.SAMPLER(learned_from, seed)
        self.model = self._build(config)
        self.model.set_statistics(*measure_statistics(self.SAMPLER(learned_from, seed)))
        self.model.to(self.device)
        self.objective = self.OBJECTIVE(self.model, recipe)
        if distributed.is_initialized():  # gives every process the first one's network
            self.objective = nn.parallel.DistributedDataParallel(self.objective)
        self.average = torch.optim.swa_utils.AveragedModel(self.model, avg_fn=self._averaged)
        self.optimizer = torch.optim.RAdam(
            self.model.parameters(), recipe.learning_rate, (recipe.momentum, SECOND_MOMENT)
        )
        held_out = self.SAMPLER(data.split(held_out=True), seed)
        self.held_out = [
            (held_out.batch(recipe.batch), draw_mixing(held_out.random, recipe.batch)) for _ in range(HELD_OUT_BATCHES)
        ]
        self.step, self.spent = 0, 0.0
        self.recent: list[dict[str, float]] = []  # losses of the steps since the last row
        self.rows: list[dict[str, float]] = []  # of the curve, since the last log

    def _build(self, config: Any) -> Scaled:
        """The network that learns."""
        return MotionPuzzle(config)

    def update(self, progress: float) -> dict[str, float]:
        """One step of the optimiser; progress 0..1 sets the learning rate. Returns the losses by name."""
        start = time.perf_counter()
        self.optimizer.param_groups[0]["lr"] = self.recipe.learning_rate * learning_rate_at(progress)
        size, late = self.recipe.batch, progress > DECAY_FROM
        terms = self._losses(self.objective, self.sampler.batch(size), draw_mixing(self.sampler.random, size), late)
        total = self._total(terms)
        if total.requires_grad:  # BP-AdaIN of joints alone reads statistics: nothing of it is learned
            self.optimizer.zero_grad(set_to_none=True)
            total.backward()
            torch.nn.utils.clip_grad_norm_(self.model.parameters(), 1.0)
            self.optimizer.step()
        return self._counted(terms, start)

    def _total(self, terms: dict[str, torch.Tensor]) -> torch.Tensor:
        """The terms' sum, each as much as the recipe says."""
        weighted = (self.recipe.weights[name] * value for name, value in terms.items())
        return sum(weighted, torch.zeros((), device=self.device))

    def _counted(self, terms: dict[str, torch.Tensor], start: float) -> dict[str, float]:
        """Ends a step that began at `start` seconds: average, clock and curve. Gives the losses as numbers."""
        self.average.update_parameters(self.model)
        self.step += 1
        self.spent = share_first(self.spent + time.perf_counter() - start)
        result = {name: value.item() for name, value in terms.items()}
        self.recent.append(result)
        if len(self.recent) == LOG_EVERY:
            self._close_row()
        return result

    def _close_row(self) -> None:
        means = {
            name: float(np.mean([losses[name] for losses in self.recent if name in losses] or [np.nan]))
            for name in self.recipe.weights
        }
        self.rows.append({"step": self.step, "minutes": self.spent / 60, **means})
        self.recent = []

    def _losses(
        self, objective: nn.Module, batch: Batch, use_target: np.ndarray, late: bool = True
    ) -> dict[str, torch.Tensor]:
        windows = {field.name: torch.from_numpy(getattr(batch, field.name)).to(self.device) for field in fields(batch)}
        inputs = self.INPUTS(
            **{name: self.model.normalize(window) if window.dim() == 4 else window for name, window in windows.items()},
            use_target=torch.from_numpy(use_target).to(self.device),
        )
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.half):
            return objective(inputs, late)

    @torch.no_grad()
    def held_out_losses(self) -> dict[str, float]:
        """The averaged network's losses on clips that it never trains on."""
        objective = self.OBJECTIVE(self.average.module, self.recipe)
        totals = [self._losses(objective, batch, mixing) for batch, mixing in self.held_out]
        return {name: float(np.mean([t[name].item() for t in totals])) for name in totals[0]}

    def keep(self, path: Path) -> None:
        """Writes the checkpoint."""
        state = {name: getattr(self, name).state_dict() for name in self.KEPT}
        random = self.sampler.random.bit_generator.state
        with atomic_write(path) as temporary:
            torch.save(
                {**state, "step": self.step, "spent": self.spent, "random": random, "origin": dict(self.origin)},
                temporary,
            )

    def restore(self, path: Path) -> None:
        """Goes back to a checkpoint. Raises ValueError where there is none, it is another network's or
        recipe's, or it began with other weights."""
        if not path.exists():
            raise ValueError(f"no checkpoint at {path}: train without --resume first")
        try:
            state = torch.load(path, map_location=self.device, weights_only=True)
            for name in self.KEPT:
                getattr(self, name).load_state_dict(state[name])
            self.sampler.random.bit_generator.state = state["random"]
            self.step, self.spent = int(state["step"]), float(state["spent"])
            began_with = state.get("origin", self.origin)
        except OSError:
            raise
        except Exception as error:  # a damaged file fails in many ways
            raise ValueError(
                f"{path} is damaged, or another network's or recipe's: train anew, into another --out"
            ) from error
        if began_with != self.origin:
            raise ValueError(f"{path} is of a run that began with other weights: name those with --start")

    def log(self, path: Path) -> None:
        """Appends what was gathered since the last call to the curve's CSV, the newest row with the held-out losses."""
        if self.recent:
            self._close_row()
        held_out = self.held_out_losses()
        fields = [*self.rows[0], *(f"held_out_{name}" for name in held_out)]
        self.rows[-1].update({f"held_out_{name}": value for name, value in held_out.items()})
        new = not path.exists() or self.rows[0]["step"] <= LOG_EVERY
        with path.open("w" if new else "a", newline="") as file:
            writer = csv.DictWriter(file, fields)
            if new:
                writer.writeheader()
            writer.writerows(self.rows)
        self.rows = []

    def save_weights(self, path: Path, data_dir: Path, command: str) -> None:
        """Writes the averaged network's weight file."""
        clips = self.sampler.data.clips
        folders = sorted({clip.name.split("/")[0] for clip in clips})
        checkpoint.save(
            of_kind(Scaled, self.average.module),
            path,
            data=f"{data_dir.name}: {', '.join(folders[:12])}",
            licence=f"trained on {credit(data_dir, (data_dir / clip.name for clip in clips))}",
            command=command,
            commit=commit(),
            steps=str(self.step),
            **self.origin,
        )

    def _averaged(self, average: torch.Tensor, value: torch.Tensor, count: torch.Tensor | int) -> torch.Tensor:
        keep = torch.clamp(torch.as_tensor((1 + count) / (10 + count)), max=self.recipe.average)  # sooner at first
        return value + (average - value) * keep


def learning_rate_at(progress: float) -> float:
    """The share of the learning rate at 0..1 of the time: all of it, then down along a cosine to FINAL_RATE."""
    decay = min(max(0.0, (progress - DECAY_FROM) / (1 - DECAY_FROM)), 1.0)
    return FINAL_RATE + (1 - FINAL_RATE) * 0.5 * (1 + math.cos(math.pi * decay))


def draw_mixing(random: np.random.Generator, size: int) -> np.ndarray:
    """(5, B) of bool: parts that take the target's style (Alg. 1: at a rate of MIXING, 1 to 5 keep the source's)."""
    order = random.random((len(PARTS), size)).argsort(axis=0)
    kept = np.where(random.random(size) < MIXING, random.integers(1, len(PARTS) + 1, size), 0)
    return order >= kept


def has_fast_bf16(device: torch.device) -> bool:
    """Whether the chip multiplies bf16 matrices faster than float32 ones."""
    if device.type == "cuda":
        return torch.cuda.is_bf16_supported()
    return torch.cpu._is_amx_tile_supported()
