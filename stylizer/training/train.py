"""Training of the stylizers: unlabelled clips or labelled ones, one CPU core, a GPU, or several processes.

torchrun --nproc-per-node 2 -m demo train stylizer --data DIR --out OUT
"""

import csv
from pathlib import Path
from typing import Callable, Sequence, TypeVar

from tqdm import tqdm

from sim.io.provenance import SHIPPED
from stylizer.data.dataset import MotionData, pack
from stylizer.runtime.catalogue import STYLES
from stylizer.styles.bundled_styles import build_bundled
from stylizer.styles.code_bank import build_codes
from stylizer.systems.motion_puzzle.objective import RECIPES
from stylizer.systems.registry import system_of_network
from stylizer.training.distributed import Processes, wait
from stylizer.training.train_joints import JointTrainer
from stylizer.training.train_live import LiveTrainer, load_start
from stylizer.training.train_systems import SystemTrainer
from stylizer.training.trainer import Trainer

FIRST_CHECKPOINT, CHECKPOINT_SECONDS = 30, 240  # of training, until the first one and between two
LIVE = "live"  # the recipe of stylizer.training.train_live

# Trainers of the systems that have one recipe, by kind.
ONE_RECIPE: dict[str, Callable[[MotionData, str, int], Trainer]] = {
    "motion-puzzle-joints": JointTrainer,
    "unpaired": SystemTrainer,
    "diverse": SystemTrainer,
    "latent": SystemTrainer,
}
T = TypeVar("T")


def train(
    data_dir: Path,
    out_dir: Path,
    minutes: float = 60,
    resume: bool = False,
    seed: int = 1,
    network: str = SHIPPED,
    recipe: str = "ours",
    leave_out: Sequence[str] = (),
    steps: int | None = None,
    start: Path | None = None,
) -> Path:
    """Trains on every BVH under data_dir; writes pack, checkpoint, curve (CSV, PNG), weights and styles under out_dir.

    network and recipe: names of stylizer.systems.registry.all_networks and of `objective.RECIPES`; a whole-body network
    has a recipe of its own, and `live`, which goes on from the trained weights `start` (stylizer.training.train_live).
    Stops after `minutes` of training in all, or `steps` where networks are to be compared that cost unlike; `resume`
    goes on from the checkpoint exactly where it stopped, random numbers included. leave_out: words; clips with one of
    them in their name are not learned from. Under torchrun every process draws its own windows and the first one
    writes. Returns the weight file's path. Raises ValueError for unknown names and where the folder holds nothing to
    learn from."""
    data_dir, out_dir = Path(data_dir), Path(out_dir)
    state, path = out_dir / "checkpoint.pt", out_dir / f"{network}.safetensors"
    make = make_trainer(network, recipe, start)
    if start and path.exists() and path.samefile(start):
        raise ValueError(f"training would write over {start}, which it goes on from: choose another folder with --out")
    with Processes() as rank:
        if rank == 0:
            pack(data_dir, out_dir / "motion")
        wait()
        data = MotionData.open(out_dir / "motion").without(leave_out)
        if rank == 0:
            for reason, count in data.skipped.items():
                tqdm.write(f"skipped {count} clips: {reason}")
        trainer = make(data, seed + 1000 * rank)
        if resume:
            trainer.restore(state)
        budget, unit = (steps, " steps") if steps else (minutes * 60, "s")

        def done() -> float:
            return trainer.step if steps else trainer.spent

        saved = trainer.spent
        with tqdm(
            total=round(budget), initial=round(done()), unit=unit, desc="train stylizer", disable=rank > 0
        ) as bar:
            while done() < budget:
                terms = trainer.update(done() / budget)
                bar.n = min(round(done()), bar.total)
                bar.set_postfix_str(" ".join(f"{key} {value:.3f}" for key, value in terms.items()))
                bar.update(0)
                interval = CHECKPOINT_SECONDS if saved else FIRST_CHECKPOINT
                if rank == 0 and (trainer.spent - saved > interval or done() >= budget):
                    saved = trainer.spent
                    trainer.log(out_dir / "curve.csv")
                    trainer.keep(state)
                    until = f"--steps {steps}" if steps else f"--minutes {minutes:g}"
                    command = f"patchwalk train stylizer {until} --network {network} --recipe {recipe}"
                    command += f" --start {start.name}" if start else ""
                    command += f" --leave-out {' '.join(leave_out)}" if leave_out else ""
                    trainer.save_weights(path, data_dir, command)
        if rank == 0:
            plot_curve(out_dir / "curve.csv")
            build = build_bundled if system_of_network(network).by_part else build_codes
            build(network, out_dir, data_dir, out_dir / STYLES)
        wait()
    return path


def make_trainer(network: str, recipe: str, start: Path | None = None) -> Callable[[MotionData, int], Trainer]:
    """What makes the trainer of a network, of data and a seed; start: weights, for the recipe `live` alone. Raises
    ValueError for unknown names."""
    system = system_of_network(network)
    if (recipe == LIVE) != (start is not None):
        raise ValueError(f"--recipe {LIVE} goes on from trained weights: give both --recipe {LIVE} and --start FILE")
    if start is not None:
        if ONE_RECIPE.get(system.kind) is not SystemTrainer:
            raise ValueError(f"{network} has no recipe {LIVE}: it is for unpaired, diverse and latent")
        load_start(start, network)  # a mistake in it is said before the motion is read
        return lambda data, seed: LiveTrainer(data, network, start, seed)
    if system.kind in ONE_RECIPE:
        if recipe != "ours":
            raise ValueError(f"{network} has one recipe: leave --recipe out")
        return lambda data, seed: ONE_RECIPE[system.kind](data, network, seed)
    how = look_up(RECIPES, recipe, "recipe")
    return lambda data, seed: Trainer(data, system.load_configs()[network], how, seed)


def look_up(table: dict[str, T], name: str, what: str) -> T:
    """What a table has under a name. Raises ValueError for another one."""
    if name not in table:
        raise ValueError(f"there is no {what} '{name}': use one of {', '.join(table)}")
    return table[name]


def plot_curve(path: Path) -> None:
    """Draws the CSV's losses as a PNG beside it: lines for training, dots for the held-out clips."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    with path.open() as file:
        rows = list(csv.DictReader(file))
    figure, axes = plt.subplots(figsize=(8, 4.5))
    for color, name in enumerate(name[len("held_out_") :] for name in rows[0] if name.startswith("held_out_")):
        for label, style in ((name, "-"), (f"held_out_{name}", "o")):
            points = [(float(r["minutes"]), float(r[label])) for r in rows if r[label]]
            axes.plot(*zip(*points), style, color=f"C{color}", label=label.replace("_", " "))
    axes.set(xlabel="minutes", yscale="log", title="stylizer")
    axes.legend(fontsize=7, ncols=2)
    figure.savefig(path.with_suffix(".png"), dpi=120)
    plt.close(figure)
