"""Trains a controller on a folder of BVH files: `python -m demo.examples.train_controller mocap runs/mine 30`.

`patchwalk train controller` does the same and ends with the own style of the new controller."""

import sys
from pathlib import Path

from controller.training.train import train


def main(data: str, out: str, minutes: str = "30") -> None:
    weights = train(Path(data), Path(out), float(minutes))
    print(f"wrote {weights}")


if __name__ == "__main__":
    if len(sys.argv) <= 2:
        sys.exit(__doc__)
    main(*sys.argv[1:4])
