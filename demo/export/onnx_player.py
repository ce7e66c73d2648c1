"""Plays a Patchwalk recording on the exported graphs, with numpy and onnxruntime alone: what an engine's port does.

    patchwalk replay walk.jsonl --headless --poses walk.npz
    python player.py walk.jsonl --compare walk.npz     # how far it is from that

One frame is `Player.step`. graphs.json, beside this file, says what every tensor is. Axes: metres, +Y up, +Z forwards
at yaw 0, +X to the character's left (right-handed); quaternions are (w, x, y, z)."""

import argparse
import json
from pathlib import Path
from typing import Any, Iterator, Mapping, Protocol, Sequence

import numpy as np
import onnxruntime

FOLDER = Path(__file__).parent


class Ground(Protocol):
    """What an engine puts in place of HeightMap: it asks its terrain, or casts rays."""

    def sample(self, kind: str, places: np.ndarray) -> np.ndarray:
        """Heights (...) in metres at places (..., 2), world x and z; kind: heights, or smooth_heights, blurred."""


class HeightMap:
    """Heights (rows along z, columns along x) a `cell` apart about the origin, as they are and blurred."""

    def __init__(self, path: Path) -> None:
        with np.load(path) as file:
            self.tables = {"heights": file["heights"], "smooth_heights": file["smooth_heights"]}
            self.cell, self.tiled = float(file["cell"]), bool(file["tiled"])

    def sample(self, kind: str, places: np.ndarray) -> np.ndarray:
        """Bilinear."""
        table = self.tables[kind]
        size = np.array(table.shape[::-1])
        cells = places / self.cell + size // 2
        low = np.floor(cells).astype(int)
        x, z = (
            [(low + one)[..., axis] % size[axis] if self.tiled else np.clip((low + one)[..., axis], 0, size[axis] - 1)
             for one in (0, 1)]
            for axis in (0, 1)
        )  # fmt: skip
        share_x, share_z = np.moveaxis(cells - low, -1, 0)
        left, right = (table[z[0], at] + (table[z[1], at] - table[z[0], at]) * share_z for at in x)
        return left + (right - left) * share_x


class Player:
    """A character that `step` moves by a sixtieth of a second."""

    def __init__(self, folder: Path = FOLDER, ground: Ground | None = None) -> None:
        """ground: None for level floor."""
        self.about = json.loads((Path(folder) / "graphs.json").read_text())
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = 1  # the graphs are small
        self.numbers = np.dtype(self.about["numbers"]).newbyteorder("<")
        self.ground = ground
        self.graphs: dict[str, Any] = {}
        self.states: dict[str, np.ndarray] = {}
        for name, graph in self.about["graphs"].items():
            if graph["ground"] in ("any", "flat" if ground is None else "uneven"):
                self.graphs[name] = onnxruntime.InferenceSession(
                    str(Path(folder) / graph["file"]), options, providers=["CPUExecutionProvider"]
                )
                self.states[graph["state"]] = np.fromfile(Path(folder) / graph["state"], self.numbers)
        self.styles = {style["name"]: number for number, style in enumerate(self.about["styles"])}
        self.origin = np.zeros(2)  # x and z of the root: graphs tell places from it
        self.heights: list[float] = []  # of the ground under the root at the controller's last three frames
        self.now: dict[str, Any] = {"paces": np.ones((3, 2)), "stride": 1.0, "around": self.look_around()}

    def run(self, name: str) -> dict[str, np.ndarray]:
        """Runs a graph on what is known by now; its results are known from then on."""
        graph, file = self.graphs[name], self.about["graphs"][name]["state"]
        known = {**self.now, "state": self.states[file]}
        feeds = {each.name: np.asarray(known[each.name], self.numbers) for each in graph.get_inputs()}
        results = dict(zip([each.name for each in graph.get_outputs()], graph.run(None, feeds)))
        self.states[file] = results.pop("next_state", self.states[file])
        self.now.update(results)
        return results

    def look_around(self) -> np.ndarray:
        """The blurred ground under the root and beside it."""
        around = self.origin + self.about["around"]
        return np.zeros(len(around)) if self.ground is None else self.ground.sample("smooth_heights", around)

    def ask_ground(self, name: str) -> None:
        """Has a graph say at which places it wants to know the ground, and looks there."""
        if self.ground is not None:
            for place, values in self.run(name).items():
                kind = place.removeprefix("places_of_")  # heights_0, smooth_heights_0 ...
                self.now[kind] = self.ground.sample(kind.rpartition("_")[0], values + self.origin)

    def suffix(self, name: str) -> str:
        return name if self.ground is None else f"{name}_uneven"

    def step(
        self,
        move: Sequence[float] = (0, 0),
        face: Sequence[float] | None = None,
        gait: str = "walk",
        style: Mapping[str, Sequence] = {},  # noqa: B006
        pace: bool = False,
        jump: bool = False,
    ) -> dict[str, np.ndarray]:
        """move: (x, z), length at most 1; face: (x, z) or None; style: body part -> [style, strength] or [style,
        strength, other style, share]. The frame: positions (21, 3), rotations, local_rotations (21, 4) ..."""
        request = np.tile([-1.0, 0, -1, 0], (5, 1))
        for part, (name, strength, *blend) in style.items():
            other, share = blend or (None, 0.0)
            request[self.about["parts"].index(part)] = self.styles[name], strength, self.styles.get(other, -1), share
        gaits = self.about["gaits"]
        self.now |= {
            "request": request,
            "desired_velocity": np.array(move) * gaits[gait],
            "heading": move if face is None else face,
            "crouch": gait == "crouch",
            "jump": jump,
            "follow": pace,
            "gait": list(gaits).index(gait),
        }
        self.run("pace")
        way = np.zeros(2)
        for _ in range(int(self.now["advances"])):
            self.ask_ground("controller_places")
            moved = self.run(self.suffix("controller"))["moved"].astype(float)
            self.origin, way = self.origin + moved, way + moved
            self.now["around"] = self.look_around()
            height = self.now["around"][0]
            self.heights = [*self.heights[1:], height] if self.heights else [height] * 3
        self.now |= {"moved": way, "root_heights": self.heights}
        self.run("stylizer")
        self.ask_ground("feet_places")
        frame = self.run(self.suffix("feet"))
        over_floor = np.array([self.origin[0], 0.0, self.origin[1]])
        neutral = self.now["neutral_positions"] + over_floor
        places = {name: frame[name] + over_floor for name in ("positions", "root_position")}
        return frame | places | {"neutral_positions": neutral}


def commands(path: Path, groups: Mapping[str, Sequence[str]]) -> Iterator[dict[str, Any]]:
    """What is asked in each frame of a recording, as `Player.step` takes it; groups: name -> body parts."""
    header, *lines = [json.loads(line) for line in Path(path).read_text().splitlines() if line.strip()]
    if header.get("stylizer") not in (None, "joints"):
        raise SystemExit(f"{path} was made with another stylizer than the exported one")
    now, frame = {"pace": header.get("pace", False)}, 0
    style: dict[str, Any] = {}
    for line in [*lines, {"frame": lines[-1]["frame"] + 1}]:
        for _ in range(frame, line["frame"]):
            yield {**now, "style": style}
            now["jump"] = False
        frame, style = line["frame"], dict(style)
        for target, worn in line.get("style", {}).items():
            for part in groups.get(target, [target]):
                style[part] = worn
        style = {part: worn for part, worn in style.items() if worn is not None}
        now |= {name: line[name] for name in ("move", "face", "gait", "pace", "jump") if name in line}
        if line.get("end"):
            return


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", type=Path)
    parser.add_argument("--ground", type=Path, default=FOLDER / "ground.npz", help="for a recording that names one")
    parser.add_argument("--compare", type=Path, metavar="POSES.npz")
    args = parser.parse_args()
    header = json.loads(args.recording.read_text().partition("\n")[0])
    level = header.get("ground", "flat") == "flat"
    player = Player(ground=None if level else HeightMap(args.ground))
    frames = [player.step(**command) for command in commands(args.recording, player.about["groups"])]
    positions = np.array([frame["positions"] for frame in frames])
    print(f"{len(frames)} frames; the root ends at x {player.origin[0]:.3f}, z {player.origin[1]:.3f} m")
    if args.compare:
        apart = np.abs(positions - np.load(args.compare)["positions"]).max(axis=(1, 2))
        over = np.flatnonzero(apart > 1e-4)
        print(
            f"from {args.compare.name}: {np.median(apart):.1e} m at the median, {apart.max():.1e} m at most; "
            f"over 1e-4 m in {len(over)} frames" + (f", first in frame {over[0]}" if len(over) else "")
        )


if __name__ == "__main__":
    main()
