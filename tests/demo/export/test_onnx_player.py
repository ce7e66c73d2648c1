"""The player of the exported graphs reads recordings and grounds as the program itself does."""

import numpy as np
import pytest

pytest.importorskip("onnxruntime")

from demo import assemble  # noqa: E402
from demo.export import onnx_folder, onnx_player  # noqa: E402
from sim.body.skeleton import GROUPS  # noqa: E402
from sim.ground.catalogue import load_ground  # noqa: E402
from sim.ground.ground import Ground  # noqa: E402
from sim.io import recording  # noqa: E402


def test_it_reads_the_bundled_recording_as_the_program_does():
    recorded = list(recording.read(assemble.BUNDLED_RECORDING))
    played = list(onnx_player.commands(assemble.BUNDLED_RECORDING, GROUPS))
    assert len(played) == len(recorded)
    for asked, command in zip(played, recorded):
        face = asked["face"] and tuple(asked["face"])
        assert (tuple(asked["move"]), face, asked["gait"]) == (command.move, command.face, command.gait)
        assert (asked["pace"], asked.get("jump", False)) == (command.pace, command.jump)
        assert asked["style"] == command.style.to_json()


@pytest.mark.parametrize(
    "ground",
    [load_ground("stairs"), Ground(np.random.default_rng(2).random((5, 7)), 0.3, tiled=False)],
    ids=["tiled", "not tiled"],
)
def test_its_ground_is_as_high_as_ours(tmp_path, ground):
    onnx_folder.write_ground(tmp_path / "ground.npz", ground)
    player_ground = onnx_player.HeightMap(tmp_path / "ground.npz")
    places = np.random.default_rng(4).uniform(-40, 40, (50, 3, 2))
    for kind, height_at in (("heights", ground.height_at), ("smooth_heights", ground.smooth_height_at)):
        np.testing.assert_allclose(player_ground.sample(kind, places), height_at(places), atol=1e-6)
