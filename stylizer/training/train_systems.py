"""Training of the whole-body systems: labelled windows, and one optimiser that changes in each phase only what learns
in it."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
import torch
from torch import distributed

from sim.motion.features import POSE_CHANNELS
from sim.torch_setup import set_up_torch
from stylizer.data.dataset import MotionData
from stylizer.data.domains import DomainBatch, LabelledSampler, as_inputs, labels_of, mean_poses
from stylizer.data.sampler import measure_statistics
from stylizer.systems.motion_puzzle.objective import Recipe
from stylizer.systems.registry import all_networks
from stylizer.systems.whole_body import WholeBody
from stylizer.training.trainer import HELD_OUT_BATCHES, SECOND_MOMENT, Trainer, learning_rate_at


class SystemTrainer(Trainer):
    """A `Trainer` of a whole-body network of stylizer.systems.registry. The system's own file says what is learned: its
    RECIPE and its Objective, which gives the terms of each phase (Objective.forward) and what a phase changes
    (Objective.learned).

    Raises ValueError where the data has no labels, and under torchrun."""

    KEPT = ("objective", "average", "optimizer")
    model: WholeBody
    objective: Any  # of the system's own file
    sampler: LabelledSampler
    held_out: list[DomainBatch[np.ndarray]]  # type: ignore[assignment]  # its own batches, which it alone reads

    def __init__(self, data: MotionData, network: str, seed: int = 1) -> None:
        if distributed.is_initialized():
            raise ValueError(f"{network} learns in one process: start it without torchrun")
        torch.manual_seed(seed)
        set_up_torch(one_thread=False)
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        learned_from = data.split(held_out=False)
        self.recipe, self.objective = self._begin(learned_from, network, seed)
        self.model = self.objective.system
        self.sampler, held_out = (
            LabelledSampler(part, self.model.config.labels, self.model.config.window, seed)
            for part in (learned_from, data.split(held_out=True))
        )
        if not held_out.domains:  # a small set's held-out clips may be without labels
            held_out = LabelledSampler(learned_from, self.model.config.labels, self.model.config.window, seed)
        self.objective.to(self.device)
        self.average = torch.optim.swa_utils.AveragedModel(self.model, avg_fn=self._averaged)
        self.learned = {
            phase: [p for parameters, _ in groups for p in parameters]
            for phase, groups in self.objective.learned().items()
        }
        self.optimizer = torch.optim.Adam(
            [
                {"params": parameters, "rate": rate}
                for groups in self.objective.learned().values()
                for parameters, rate in groups
            ],
            betas=(self.recipe.momentum, SECOND_MOMENT),
        )
        self.held_out = [held_out.batch(self.recipe.batch) for _ in range(HELD_OUT_BATCHES)]
        self.progress, self.step, self.spent, self.recent, self.rows = 0.0, 0, 0.0, [], []

    def _begin(self, data: MotionData, network: str, seed: int) -> tuple[Recipe, Any]:
        """The recipe, and the objective with a new network that knows the data's labels and statistics."""
        system, labels = all_networks()[network], labels_of(data)
        module, config = system.load_training(), replace(system.load_configs()[network], labels=labels)
        objective = module.Objective(config)
        objective.system.set_statistics(*measure_statistics(LabelledSampler(data, labels, config.window, seed)))
        objective.system.mean_poses.copy_(
            mean_poses(objective.system, LabelledSampler(data, labels, config.window, seed), POSE_CHANNELS)
        )
        return module.RECIPE, objective

    def update(self, progress: float) -> dict[str, float]:
        """One step of every phase that is on; progress 0..1 sets phases and learning rate. Returns the losses by
        name."""
        start, self.progress = time.perf_counter(), progress
        phases, done = self.objective.schedule(progress)
        for group in self.optimizer.param_groups:
            group["lr"] = self.recipe.learning_rate * group["rate"] * learning_rate_at(done)
        inputs = as_inputs(self.sampler.batch(self.recipe.batch), self.model, self.device)
        terms: dict[str, torch.Tensor] = {}
        for phase in phases:
            found = self.objective(phase, inputs, self.step)
            self._learn(self.learned[phase], self._total(found))
            terms |= found
        return self._counted(terms, start)

    def _learn(self, parameters: list[torch.nn.Parameter], total: torch.Tensor) -> None:
        """One step of the optimiser with the gradients of these parameters alone."""
        for parameter, gradient in zip(parameters, torch.autograd.grad(total, parameters, allow_unused=True)):
            parameter.grad = gradient
        torch.nn.utils.clip_grad_norm_(parameters, 1.0)
        self.optimizer.step()
        self.optimizer.zero_grad(set_to_none=True)

    def held_out_losses(self) -> dict[str, float]:
        """The losses of the phase that is on, on clips that are never learned from; nan for those of other phases."""
        phase = self.objective.schedule(self.progress)[0][-1]
        with torch.no_grad():
            totals = [self.objective(phase, as_inputs(batch, self.model, self.device), 1) for batch in self.held_out]
        return {
            name: float(np.mean([terms[name].item() for terms in totals])) if name in totals[0] else float("nan")
            for name in self.recipe.weights
        }
