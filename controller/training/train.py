"""Training of the controller: rollouts on its own poses, so that it learns to stay on the rails it will run on."""

import csv
import math
import sys
import time
from pathlib import Path

import numpy as np
import torch
from tqdm import tqdm

from controller.model import idle_layer
from controller.model.checkpoint import MODEL, fingerprint, load, save
from controller.model.io_layout import GAITS, INPUT, INPUT_SLICES, OUTPUT_SLICES, POSE, POSE_SIZE
from controller.model.network import PhaseFunctionedNetwork
from controller.training.dataset import Frames, load_folder, neutral_files
from controller.training.losses import compute_losses, joint_positions, root_displacement
from sim.body.skeleton import JOINT_COUNT
from sim.io.atomic_write import atomic_write
from sim.io.provenance import commit, credit

HIDDEN = 288  # units of a layer: a set of weights, an entry of the phase table, is 0.97 MB
BATCH = 2048  # frames an update, however long the rollouts
LEARNING_RATE = 1e-3
DECAY_FROM = 0.1  # share of the time after which the learning rate falls along a cosine
# of it that is left at the end: what was trained on to nothing fitted the clips better and walked worse
LAST_RATE = 0.4
AVERAGE = 0.999  # of the weights, exponentially
# From which share of the time on, rollouts of how many frames. The last are as long as a step of a run, so that a gait
# that drifts into another one is seen, and cost half as much again an update.
ROLLOUTS = ((0.0, 1), (0.1, 4), (0.25, 8), (0.55, 16), (0.85, 32))
POSE_SCALE = 0.3  # joint inputs are scaled down so that the trajectory matters (Holden et al. 2017 take 0.1)
POSE_NOISE = 0.1  # standard deviations, on the pose a rollout starts from
TRAJECTORY_NOISE = 0.02  # metres and direction units: the stick's wish is never quite a real future
STARTED = 0.3  # share of the schedule that weights to start from have behind them
HALF_PRECISION_UNTIL = 0.8  # share of the time that runs in bf16 where the chip multiplies it faster
FIRST_CHECKPOINT, CHECKPOINT_SECONDS = 30, 180  # of training, until the first one and between two


def train(
    data_dir: Path, out_dir: Path, minutes: float = 60, resume: bool = False, seed: int = 1, start: Path | None = None
) -> Path:
    """Trains on every neutral clip under data_dir and writes weights, checkpoint and curve under out_dir.

    Stops after `minutes` of training in all, or at Ctrl-C, with a checkpoint either way; `resume` goes on from it
    exactly where it stopped, random numbers included; `start` is a weight file to begin with instead of chance. Says
    first what it will write. Returns the weight file's path. Raises ValueError where the folder holds nothing to learn
    from, or where nothing is left to do."""
    out_dir.mkdir(parents=True, exist_ok=True)
    begun = load(start.stem, start.parent) if start else None
    trainer = Trainer(_cached(data_dir, out_dir / "frames.npz"), seed, start=begun)
    checkpoint = out_dir / "checkpoint.pt"
    budget = minutes * 60
    if resume:
        trainer.restore(checkpoint)
        if trainer.spent >= budget:
            raise ValueError(
                f"the run in {out_dir} has trained for its {minutes:g} minutes: give it more with --minutes, or train "
                "another with --out"
            )
    try:
        _run(trainer, out_dir, data_dir, minutes, start)
    except KeyboardInterrupt:
        trainer.keep(checkpoint)
        print(
            f"\nstopped after {trainer.spent / 60:.1f} minutes: go on with --resume --data {data_dir} --out {out_dir}",
            file=sys.stderr,
        )
        raise
    plot_curve(out_dir / "curve.csv")
    return out_dir / f"{MODEL}.safetensors"


def _run(trainer: "Trainer", out_dir: Path, data_dir: Path, minutes: float, start: Path | None) -> None:
    """Updates until the minutes are over, with weights, checkpoint and a line of the curve every CHECKPOINT_SECONDS."""
    budget, saved = minutes * 60, trainer.spent
    checkpoint, curve = out_dir / "checkpoint.pt", out_dir / "curve.csv"
    with tqdm(total=round(budget), initial=round(trainer.spent), unit="s", desc="train controller") as bar:
        while trainer.spent < budget:
            losses = trainer.update(trainer.spent / budget)
            bar.n = min(round(trainer.spent), bar.total)
            bar.set_postfix_str(" ".join(f"{name} {value:.3f}" for name, value in losses.items()))
            bar.update(0)
            if trainer.spent - saved > (CHECKPOINT_SECONDS if saved else FIRST_CHECKPOINT) or trainer.spent >= budget:
                saved = trainer.spent
                trainer.log(curve)
                trainer.keep(checkpoint)
                _save_weights(trainer, out_dir, data_dir, minutes, start)


class Trainer:
    """Network, optimiser, random numbers and clock: everything that a resumed run needs."""

    def __init__(
        self, frames: Frames, seed: int = 1, hidden: int = HIDDEN, start: PhaseFunctionedNetwork | None = None
    ) -> None:
        """start: a trained network to begin with, whose size counts."""
        torch.manual_seed(seed)
        self.device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
        self.random = np.random.default_rng(seed)
        self.network = PhaseFunctionedNetwork(start.hidden if start else hidden)
        if start:
            self.network.load_state_dict(start.state_dict())
        self.begun = STARTED if start else 0.0
        set_statistics(self.network, frames)
        self.network.to(self.device)
        self.average = torch.optim.swa_utils.AveragedModel(
            self.network, multi_avg_fn=torch.optim.swa_utils.get_ema_multi_avg_fn(AVERAGE)
        )
        self.optimizer = torch.optim.AdamW(self.network.parameters(), LEARNING_RATE, weight_decay=1e-4)
        self.spent = 0.0
        self.history: list[dict[str, float]] = []
        self.inputs, self.targets = torch.from_numpy(frames.inputs), torch.from_numpy(frames.targets)
        self.phase = torch.from_numpy(frames.phase)
        learned = ~frames.held_out if not frames.held_out.all() else frames.held_out  # too few clips to hold any out
        self.split = {"train": Starts(frames, learned), "held_out": Starts(frames, frames.held_out)}

    @property
    def averaged(self) -> PhaseFunctionedNetwork:
        """The network with the mean weights of the last updates."""
        network = self.average.module
        assert isinstance(network, PhaseFunctionedNetwork)
        return network

    def update(self, progress: float) -> dict[str, float]:
        """One step of the optimiser; progress 0..1 sets rollout length and learning rate. Returns the losses by
        name."""
        start = time.perf_counter()
        progress = self.begun + (1 - self.begun) * progress
        decay = max(0.0, (progress - DECAY_FROM) / (1 - DECAY_FROM))
        self.optimizer.param_groups[0]["lr"] = LEARNING_RATE * (
            LAST_RATE + (1 - LAST_RATE) * 0.5 * (1 + math.cos(math.pi * min(decay, 1.0)))
        )
        length = [n for share, n in ROLLOUTS if progress >= share][-1]
        starts = self.split["train"].draw(self.random, length, BATCH // length)
        half = has_fast_bf16(self.device) and progress < HALF_PRECISION_UNTIL
        with torch.autocast(self.device.type, torch.bfloat16, enabled=half):
            losses = self.rollout(starts, length, noise=True)
        self.optimizer.zero_grad(set_to_none=True)
        losses["loss"].backward()
        torch.nn.utils.clip_grad_norm_(self.network.parameters(), 1.0)
        self.optimizer.step()
        self.average.update_parameters(self.network)
        result = {name: value.item() for name, value in losses.items()}
        self.history.append(result)
        self.spent += time.perf_counter() - start
        return result

    def rollout(
        self, starts: np.ndarray, length: int, noise: bool, network: PhaseFunctionedNetwork | None = None
    ) -> dict[str, torch.Tensor]:
        """Losses over `length` frames from each start, pose and phase fed back as at run time, the trajectory from the
        data.

        network: another than the one in training."""
        network = network or self.network
        total: dict[str, torch.Tensor] = {}
        phase = self.phase[starts].to(self.device)
        for t in range(length):
            x, target = self.inputs[starts + t].to(self.device), self.targets[starts + t].to(self.device)
            if noise:
                x[:, : POSE.start] += TRAJECTORY_NOISE * torch.randn_like(x[:, : POSE.start])
            if t == 0:
                pose = x[:, POSE]
                if noise:
                    pose = pose + POSE_NOISE * POSE_SCALE * network.input_std[POSE] * torch.randn_like(pose)
                before = truth_before = pose[:, : 3 * JOINT_COUNT].view(-1, JOINT_COUNT, 3)
            y = network(torch.cat([x[:, : POSE.start], pose], dim=1), phase)
            pose = y[:, :POSE_SIZE]
            phase = torch.remainder(phase + y[:, OUTPUT_SLICES["phase"]][:, 0], 2 * math.pi)
            joints, truth = joint_positions(y), joint_positions(target)
            astray = root_displacement(y, before, joints) - root_displacement(target, truth_before, truth)
            before, truth_before = joints, truth
            for name, value in compute_losses(y, target, network.output_std, joints - truth, astray).items():
                total[name] = total.get(name, 0) + value / length
        return total

    @torch.no_grad()
    def log(self, path: Path) -> None:
        """Appends the mean training losses since the last line, and the averaged weights' on held-out clips, to a
        CSV."""
        recent = self.history[-500:]
        row = {
            "minutes": self.spent / 60,
            **{f"train_{name}": np.mean([h[name] for h in recent]) for name in recent[-1]},
        }
        held_out = self.split["held_out"]
        if len(held_out.starts):
            starts = held_out.draw(np.random.default_rng(0), 16, 256)
            losses = self.rollout(starts, 16, noise=False, network=self.averaged)
            row |= {f"held_out_{name}": value.item() for name, value in losses.items()}
        new = not path.exists()
        with path.open("a", newline="") as file:
            writer = csv.DictWriter(file, list(row))
            if new:
                writer.writeheader()
            writer.writerow({name: f"{value:.5f}" for name, value in row.items()})

    def keep(self, path: Path) -> None:
        """Writes the checkpoint: a complete file or none."""
        state = {
            "network": self.network.state_dict(),
            "average": self.average.state_dict(),
            "optimizer": self.optimizer.state_dict(),
            "spent": self.spent,
            "begun": self.begun,
            "random": self.random.bit_generator.state,
            "torch_random": torch.get_rng_state(),
        }
        with atomic_write(path) as temporary:
            torch.save(state, temporary)

    def restore(self, path: Path) -> None:
        """Goes on from a checkpoint. Raises ValueError where there is none, or it is damaged."""
        if not path.exists():
            raise ValueError(f"nothing to resume: {path} does not exist")
        try:
            state = torch.load(path, weights_only=True)
            for name in ("network", "average", "optimizer"):
                getattr(self, name).load_state_dict(state[name])
            self.spent, self.begun = float(state["spent"]), state["begun"]
            self.random.bit_generator.state = state["random"]
            torch.set_rng_state(state["torch_random"])
        except OSError:
            raise
        except Exception as error:  # a damaged file fails in many ways
            raise ValueError(f"{path} is damaged, or another network's: train anew, into another --out") from error


def has_fast_bf16(device: torch.device) -> bool:
    """Whether bf16 matrix products are faster than float32 ones here: a GPU that knows them, or a CPU with tile
    units."""
    return torch.cuda.is_bf16_supported() if device.type == "cuda" else torch.cpu._is_amx_tile_supported()


class Starts:
    """Where rollouts may begin: drawn by weight, never across the end of a clip."""

    def __init__(self, frames: Frames, chosen: np.ndarray) -> None:
        """chosen (N,) bool: the frames that may be drawn."""
        self.starts = np.flatnonzero(chosen)
        weight = frames.weight[self.starts]
        self.cumulative = np.cumsum(weight / weight.sum()) if len(weight) else weight
        ends = np.flatnonzero(frames.last)
        # Frames (N,) from each one to the end of its clip, itself included.
        self.left = ends[np.searchsorted(ends, np.arange(len(frames.last)))] - np.arange(len(frames.last)) + 1

    def draw(self, random: np.random.Generator, length: int, count: int) -> np.ndarray:
        """Frame indices (count,) from which `length` frames follow in the same clip; a start too late is moved back."""
        starts = self.starts[np.searchsorted(self.cumulative, random.random(count)).clip(max=len(self.starts) - 1)]
        return starts - np.maximum(0, length - self.left[starts])


def set_statistics(network: PhaseFunctionedNetwork, frames: Frames) -> None:
    """Means per number; one standard deviation per named part and component, so that quiet joints stay quiet."""
    for values, where, kind in ((frames.inputs, INPUT_SLICES, "input"), (frames.targets, OUTPUT_SLICES, "output")):
        getattr(network, f"{kind}_mean").copy_(torch.from_numpy(values.mean(axis=0)))
        deviation = torch.from_numpy(values.std(axis=0))
        for name, part in where.items():
            if name != "root":  # sideways, forward and turn have units of their own
                deviation[part] = deviation[part].mean()
        if kind == "input":
            deviation[POSE] /= POSE_SCALE
        else:
            contacts = where["contacts"]
            network.output_mean[contacts], deviation[contacts] = 0.0, 1.0
        getattr(network, f"{kind}_std").copy_(deviation.clamp(min=1e-4))
    gaits = frames.inputs[:, INPUT_SLICES["trajectory_gaits"]].reshape(-1, *INPUT["trajectory_gaits"])
    heights = np.ptp(frames.inputs[:, INPUT_SLICES["trajectory_heights"]], axis=1)
    stand = gaits[..., GAITS.index("stand")].mean(axis=1) - gaits[..., GAITS.index("crouch")].max(axis=1) - heights
    network.idle.copy_(torch.from_numpy(idle_layer.fit(frames.inputs, frames.targets, frames.clip)))
    network.standing.copy_(torch.from_numpy(frames.inputs[stand > stand.max() - 1e-3, POSE].mean(axis=0)))


def _cached(data_dir: Path, cache: Path) -> Frames:
    """The folder's frames, kept beside the run so that a resumed one starts at once."""
    print(f"writes weights, checkpoint and curve into {cache.parent}", flush=True)
    if cache.exists():
        try:
            with np.load(cache) as file:
                arrays = {name: file[name] for name in file.files}
            return Frames(**arrays | {"names": arrays["names"].tolist()})
        except OSError:
            raise
        except Exception as error:  # as above
            raise ValueError(f"{cache} is damaged: delete it, and the clips are read again") from error
    frames = load_folder(data_dir)
    size = sum(value.nbytes for value in vars(frames).values() if isinstance(value, np.ndarray)) / 1e9
    print(
        f"keeps the frames of {len(frames.names)} clips in {cache}, {size:.1f} GB: delete it when you are done",
        flush=True,
    )
    with atomic_write(cache) as temporary:  # half a file would stop every later start
        np.savez(temporary, **vars(frames))
    return frames


def _save_weights(trainer: Trainer, out_dir: Path, data_dir: Path, minutes: float, start: Path | None = None) -> None:
    credits = f"trained on {credit(data_dir, neutral_files(data_dir))}"
    origin = {"started_from": fingerprint(start.stem, start.parent)} if start else {}
    command = f"patchwalk train controller --minutes {minutes:g}" + (f" --start {start.name}" if start else "")
    save(
        trainer.averaged.cpu(),
        out_dir / f"{MODEL}.safetensors",
        licence=credits,
        command=command,
        commit=commit(),
        **origin,
    )
    trainer.averaged.to(trainer.device)


def plot_curve(path: Path) -> None:
    """Draws the CSV's training and held-out losses as a PNG beside it."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    with path.open() as file:
        rows = list(csv.DictReader(file))
    figure, axes = plt.subplots(figsize=(7, 4))
    for name in rows[0]:
        if name.endswith(("_loss", "_skeleton")):
            axes.plot([float(r["minutes"]) for r in rows], [float(r[name]) for r in rows], label=name.replace("_", " "))
    axes.set(xlabel="minutes", yscale="log", title="controller")
    axes.legend()
    figure.savefig(path.with_suffix(".png"), dpi=120)
    plt.close(figure)
