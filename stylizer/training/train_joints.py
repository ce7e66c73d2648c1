"""Training of Motion Puzzle at the resolution of joints."""

import copy
import time
from dataclasses import fields
from typing import cast

import numpy as np
import torch
from torch import distributed, nn

from sim.torch_setup import set_up_torch
from stylizer.data.dataset import MotionData
from stylizer.data.joint_sampler import JointBatch, JointSampler
from stylizer.data.sampler import measure_statistics
from stylizer.systems.motion_puzzle.joint_config import CONFIGS
from stylizer.systems.motion_puzzle.joint_model import JointPuzzle
from stylizer.systems.motion_puzzle.joint_objective import RECIPE, JointInputs, JointObjective
from stylizer.training.trainer import HELD_OUT_BATCHES, SECOND_MOMENT, Trainer, draw_mixing, learning_rate_at


class JointTrainer(Trainer):
    """A `Trainer` of a network of stylizer.systems.motion_puzzle.joint_config.CONFIGS."""

    sampler: JointSampler
    held_out: list[tuple[JointBatch, np.ndarray]]  # type: ignore[assignment]  # its own batches, which it alone reads

    def __init__(self, data: MotionData, network: str, seed: int = 1) -> None:
        torch.manual_seed(seed)
        set_up_torch(one_thread=False)
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.recipe = RECIPE
        learned_from = data.split(held_out=False)
        self.sampler = JointSampler(learned_from, seed)
        self.model = JointPuzzle(CONFIGS[network])
        drawn_before = copy.deepcopy(self.sampler.random.bit_generator.state)
        self.model.set_statistics(*measure_statistics(self.sampler))
        self.sampler.random.bit_generator.state = drawn_before
        self.model.to(self.device)
        self.objective = JointObjective(self.model)
        if distributed.is_initialized():  # gives every process the first one's network
            self.objective = nn.parallel.DistributedDataParallel(self.objective)
        self.average = torch.optim.swa_utils.AveragedModel(self.model, avg_fn=self._averaged)
        self.optimizer = torch.optim.RAdam(
            self.model.parameters(), RECIPE.learning_rate, (RECIPE.momentum, SECOND_MOMENT)
        )
        held_out = JointSampler(data.split(held_out=True), seed)
        self.held_out = [
            (held_out.batch(RECIPE.batch), draw_mixing(held_out.random, RECIPE.batch)) for _ in range(HELD_OUT_BATCHES)
        ]
        self.step, self.spent, self.recent, self.rows = 0, 0.0, [], []

    def update(self, progress: float) -> dict[str, float]:
        """One step of the optimiser; progress 0..1 sets the learning rate. Returns the losses by name."""
        start = time.perf_counter()
        self.optimizer.param_groups[0]["lr"] = RECIPE.learning_rate * learning_rate_at(progress)
        terms = self.objective(
            self._inputs(self.sampler.batch(RECIPE.batch), draw_mixing(self.sampler.random, RECIPE.batch))
        )
        self.optimizer.zero_grad(set_to_none=True)
        sum(RECIPE.weights[name] * value for name, value in terms.items()).backward()
        nn.utils.clip_grad_norm_(self.model.parameters(), 1.0)
        self.optimizer.step()
        return self._counted(terms, start)

    def _inputs(self, batch: JointBatch, use_target: np.ndarray) -> JointInputs:
        arrays = {field.name: torch.from_numpy(getattr(batch, field.name)).to(self.device) for field in fields(batch)}
        return JointInputs(
            **{name: self.model.normalize(array) if array.dim() == 4 else array for name, array in arrays.items()},
            use_target=torch.from_numpy(use_target).to(self.device),
        )

    @torch.no_grad()
    def held_out_losses(self) -> dict[str, float]:
        """The averaged network's losses on clips that it never trains on."""
        objective = JointObjective(cast(JointPuzzle, self.average.module))
        totals = [objective(self._inputs(*batch)) for batch in self.held_out]
        return {name: float(np.mean([terms[name].item() for terms in totals])) for name in totals[0]}
