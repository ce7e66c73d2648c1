"""Training of the stylizer: unlabelled clips, style mixing by part (Alg. 1), one CPU core, a GPU, or several processes.

    torchrun --nproc-per-node 2 -m demo train stylizer --data DIR --out OUT
"""

import csv
import math
import os
import time
from dataclasses import fields
from datetime import timedelta
from pathlib import Path
from typing import Callable, Sequence, TypeVar

import numpy as np
import torch
from torch import distributed, nn
from tqdm import tqdm

from sim.atomic import replacing
from sim.skeleton import PARTS
from sim.sources import commit, credit
from stylizer import bundled, codes, systems, weights
from stylizer.configs import CONFIGS, Config
from stylizer.dataset import MotionData, pack
from stylizer.losses import OURS, RECIPES, Inputs, Recipe, losses
from stylizer.motion_puzzle import MotionPuzzle
from stylizer.sampler import Batch, Sampler, statistics

DECAY_FROM = 0.5  # share of the time after which the learning rate falls along a cosine, to FINAL_RATE of it
FINAL_RATE = 0.02
SECOND_MOMENT = 0.99  # beta_2 of RAdam
MIXING = 0.5  # probability that some parts keep the source's style (gamma of Alg. 1)
CHECKPOINT_SECONDS = 240
LOG_EVERY = 50  # steps
FIRST_CLIPS = 256  # from whose poses key poses start
HELD_OUT_BATCHES = 8
PATIENCE = timedelta(minutes=10)  # of a process for the others

T = TypeVar("T")


def train(data_dir: Path, out_dir: Path, minutes: float = 60, resume: bool = False, seed: int = 1,
          network: str = weights.SLIM, recipe: str = "ours", leave_out: Sequence[str] = (), steps: int | None = None) -> Path:
    """Trains on every BVH under data_dir; writes pack, checkpoint, curve (CSV, PNG), weights and styles under out_dir.

    network and recipe: names of `configs.CONFIGS` and `losses.RECIPES`; a network of `systems.NETWORKS` has a recipe of
    its own. Stops after `minutes` of training in all, or `steps` where networks are to be compared that cost unlike; `resume`
    goes on from the checkpoint exactly where it stopped, random numbers included. leave_out: words; clips with one of them in
    their name are not learned from. Under torchrun every process draws its own windows and the first one writes.
    Returns the weight file's path. Raises ValueError for unknown names and where the folder holds nothing to learn from."""
    data_dir, out_dir = Path(data_dir), Path(out_dir)
    make = trainer_of(network, recipe)
    with Processes() as rank:
        if rank == 0:
            pack(data_dir, out_dir / "motion")
        _wait()
        data = MotionData.open(out_dir / "motion").without(leave_out)
        if rank == 0:
            for reason, count in data.skipped.items():
                tqdm.write(f"skipped {count} clips: {reason}")
        trainer = make(data, seed + 1000 * rank)
        checkpoint, path = out_dir / "checkpoint.pt", out_dir / f"{network}.safetensors"
        if resume:
            trainer.restore(checkpoint)
        budget, unit = (steps, " steps") if steps else (minutes * 60, "s")

        def done() -> float:
            return trainer.step if steps else trainer.spent

        saved = trainer.spent
        with tqdm(total=round(budget), initial=round(done()), unit=unit, desc="train stylizer", disable=rank > 0) as bar:
            while done() < budget:
                terms = trainer.update(done() / budget)
                bar.n = min(round(done()), bar.total)
                bar.set_postfix_str(" ".join(f"{key} {value:.3f}" for key, value in terms.items()))
                bar.update(0)
                if rank == 0 and (trainer.spent - saved > CHECKPOINT_SECONDS or done() >= budget):
                    saved = trainer.spent
                    trainer.log(out_dir / "curve.csv")
                    trainer.keep(checkpoint)
                    until = f"--steps {steps}" if steps else f"--minutes {minutes:g}"
                    command = f"patchwalk train stylizer {until} --network {network} --recipe {recipe}"
                    left_out = f" --leave-out {' '.join(leave_out)}" if leave_out else ""
                    trainer.save_weights(path, data_dir, command + left_out)
        if rank == 0:
            plot_curve(out_dir / "curve.csv")
            (codes if network in systems.NETWORKS else bundled).build(network, out_dir, data_dir, out_dir / "styles")
        _wait()
    return path


def trainer_of(network: str, recipe: str) -> Callable[[MotionData, int], "Trainer"]:
    """What makes the trainer of a network, of data and a seed. Raises ValueError for unknown names."""
    named(CONFIGS | systems.NETWORKS, network, "network")
    if network in systems.NETWORKS:
        if recipe != "ours":
            raise ValueError(f"{network} has one recipe: leave --recipe out")
        from stylizer.train_systems import SystemTrainer
        return lambda data, seed: SystemTrainer(data, network, seed)
    how = named(RECIPES, recipe, "recipe")
    return lambda data, seed: Trainer(data, CONFIGS[network], how, seed)


class Objective(nn.Module):
    """The losses as a module's forward pass, which is what DistributedDataParallel averages the gradients of."""

    def __init__(self, model: MotionPuzzle, recipe: Recipe) -> None:
        super().__init__()
        self.model, self.recipe = model, recipe

    def forward(self, inputs: Inputs, late: bool) -> dict[str, torch.Tensor]:
        return losses(self.model, inputs, self.recipe, late)


class Trainer:
    """Network, its running average, optimiser, random numbers and clock: everything that a resumed run needs."""

    KEPT = ("model", "average", "optimizer")  # whose state a checkpoint holds

    def __init__(self, data: MotionData, config: Config, recipe: Recipe = OURS, seed: int = 1) -> None:
        torch.manual_seed(seed)
        torch.set_flush_denormal(True)
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.half = has_fast_bf16(self.device)
        self.recipe = recipe
        learned_from = data.split(held_out=False)
        self.sampler = Sampler(learned_from, seed)
        self.model = MotionPuzzle(config)
        self.model.set_statistics(*statistics(Sampler(learned_from, seed)))
        if config.key_poses:
            clips = Sampler(learned_from, seed).batch(FIRST_CLIPS).target
            self.model.key_poses.begin(self.model.normalize(torch.from_numpy(clips)))
        self.model.to(self.device)
        self.objective = Objective(self.model, recipe)
        if distributed.is_initialized():  # gives every process the first one's network
            self.objective = nn.parallel.DistributedDataParallel(self.objective)
        self.average = torch.optim.swa_utils.AveragedModel(self.model, avg_fn=self._averaged)
        self.optimizer = torch.optim.RAdam(self.model.parameters(), recipe.learning_rate, (recipe.momentum, SECOND_MOMENT))
        held_out = Sampler(data.split(held_out=True), seed)
        self.held_out = [(held_out.batch(recipe.batch), draw_mixing(held_out.random, recipe.batch))
                         for _ in range(HELD_OUT_BATCHES)]
        self.step, self.spent = 0, 0.0
        self.recent: list[dict[str, float]] = []  # losses of the steps since the last row
        self.rows: list[dict[str, float]] = []  # of the curve, since the last log

    def update(self, progress: float) -> dict[str, float]:
        """One step of the optimiser; progress 0..1 sets the learning rate. Returns the losses by name."""
        start = time.perf_counter()
        self.optimizer.param_groups[0]["lr"] = self.recipe.learning_rate * falling(progress)
        size, late = self.recipe.batch, progress > DECAY_FROM
        terms = self._losses(self.objective, self.sampler.batch(size), draw_mixing(self.sampler.random, size), late)
        self.optimizer.zero_grad(set_to_none=True)
        sum(self.recipe.weights[name] * value for name, value in terms.items()).backward()
        torch.nn.utils.clip_grad_norm_(self.model.parameters(), 1.0)
        self.optimizer.step()
        return self._counted(terms, start)

    def _counted(self, terms: dict[str, torch.Tensor], start: float) -> dict[str, float]:
        """Ends a step that began at `start` seconds: average, clock and curve. Gives the losses as numbers."""
        self.average.update_parameters(self.model)
        self.step += 1
        self.spent = _of_first(self.spent + time.perf_counter() - start)
        result = {name: value.item() for name, value in terms.items()}
        self.recent.append(result)
        if len(self.recent) == LOG_EVERY:
            self._close_row()
        return result

    def _close_row(self) -> None:
        means = {name: float(np.mean([losses[name] for losses in self.recent if name in losses] or [np.nan]))
                 for name in self.recipe.weights}
        self.rows.append({"step": self.step, "minutes": self.spent / 60, **means})
        self.recent = []

    def _losses(self, objective: nn.Module, batch: Batch, use_target: np.ndarray,
                late: bool = True) -> dict[str, torch.Tensor]:
        windows = {field.name: torch.from_numpy(getattr(batch, field.name)).to(self.device) for field in fields(batch)}
        inputs = Inputs(**{name: self.model.normalize(window) if window.dim() == 4 else window
                           for name, window in windows.items()}, use_target=torch.from_numpy(use_target).to(self.device))
        with torch.autocast(self.device.type, torch.bfloat16, enabled=self.half):
            return objective(inputs, late)

    @torch.no_grad()
    def held_out_losses(self) -> dict[str, float]:
        """The averaged network's losses on clips that it never trains on."""
        objective = Objective(self.average.module, self.recipe)
        totals = [self._losses(objective, batch, mixing) for batch, mixing in self.held_out]
        return {name: float(np.mean([t[name].item() for t in totals])) for name in totals[0]}

    def keep(self, path: Path) -> None:
        """Writes the checkpoint."""
        state = {name: getattr(self, name).state_dict() for name in self.KEPT}
        random = self.sampler.random.bit_generator.state
        with replacing(path) as temporary:
            torch.save({**state, "step": self.step, "spent": self.spent, "random": random}, temporary)

    def restore(self, path: Path) -> None:
        """Goes back to a checkpoint. Raises ValueError where there is none or it is another network's."""
        if not path.exists():
            raise ValueError(f"no checkpoint at {path}: train without --resume first")
        state = torch.load(path, map_location=self.device, weights_only=True)
        try:
            for name in self.KEPT:
                getattr(self, name).load_state_dict(state[name])
        except (RuntimeError, ValueError, KeyError) as error:
            raise ValueError(f"{path} is another network's checkpoint: train without --resume") from error
        self.sampler.random.bit_generator.state = state["random"]
        self.step, self.spent = state["step"], state["spent"]

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
        weights.save(self.average.module, path, data=f"{data_dir.name}: {', '.join(folders[:12])}",
                     licence=f"trained on {credit(data_dir, (data_dir / clip.name for clip in clips))}", command=command,
                     commit=commit(), steps=str(self.step))

    def _averaged(self, average: torch.Tensor, value: torch.Tensor, count: torch.Tensor) -> torch.Tensor:
        keep = torch.clamp((1 + count) / (10 + count), max=self.recipe.average)  # sooner at first
        return value + (average - value) * keep


def falling(progress: float) -> float:
    """The share of the learning rate at 0..1 of the time: all of it, then down along a cosine to FINAL_RATE."""
    decay = min(max(0.0, (progress - DECAY_FROM) / (1 - DECAY_FROM)), 1.0)
    return FINAL_RATE + (1 - FINAL_RATE) * 0.5 * (1 + math.cos(math.pi * decay))


def named(table: dict[str, T], name: str, what: str) -> T:
    """What a table has under a name. Raises ValueError for another one."""
    if name not in table:
        raise ValueError(f"there is no {what} '{name}': use one of {', '.join(table)}")
    return table[name]


class Processes:
    """Joins the processes that torchrun started, if it did; gives this one's rank. Leaves them again at the end."""

    def __enter__(self) -> int:
        if "WORLD_SIZE" not in os.environ:
            return 0
        distributed.init_process_group("nccl" if torch.cuda.is_available() else "gloo", timeout=PATIENCE)
        if torch.cuda.is_available():
            torch.cuda.set_device(int(os.environ["LOCAL_RANK"]))
        return distributed.get_rank()

    def __exit__(self, *error: object) -> None:
        if distributed.is_initialized():
            distributed.destroy_process_group()


def _wait() -> None:
    """For all processes to come here."""
    if distributed.is_initialized():
        distributed.barrier()


def _of_first(seconds: float) -> float:
    """The first process's clock, so that all stop after the same step."""
    if not distributed.is_initialized():
        return seconds
    clock = torch.tensor([seconds], dtype=torch.float64, device="cuda" if torch.cuda.is_available() else "cpu")
    distributed.broadcast(clock, 0)
    return clock.item()


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


def plot_curve(path: Path) -> None:
    """Draws the CSV's losses as a PNG beside it: lines for training, dots for the held-out clips."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    with path.open() as file:
        rows = list(csv.DictReader(file))
    figure, axes = plt.subplots(figsize=(8, 4.5))
    for color, name in enumerate(name[len("held_out_"):] for name in rows[0] if name.startswith("held_out_")):
        for label, style in ((name, "-"), (f"held_out_{name}", "o")):
            points = [(float(r["minutes"]), float(r[label])) for r in rows if r[label]]
            axes.plot(*zip(*points), style, color=f"C{color}", label=label.replace("_", " "))
    axes.set(xlabel="minutes", yscale="log", title="stylizer")
    axes.legend(fontsize=7, ncols=2)
    figure.savefig(path.with_suffix(".png"), dpi=120)
    plt.close(figure)
