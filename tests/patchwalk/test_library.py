"""What the library promises: the ten lines of its docstring, one sentence for a mistake, and every example as it
stands."""

import numpy as np
import pytest

import patchwalk as pw
from demo.examples import crowd, register_style, stylize_clip, train_controller, walk
from demo.tools import api
from tests.support.walker import walking_clip


@pytest.fixture
def own_styles(tmp_path, monkeypatch):
    """The user's styles go into a folder of the test's."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    return tmp_path


@pytest.fixture
def walk_file(tmp_path):
    path = tmp_path / "walk.bvh"
    pw.save_bvh(path, walking_clip(180).grounded())
    return path


def test_everything_that_is_public_is_there_and_says_what_it_is():
    for name in pw.__all__:
        said = getattr(pw, name).__doc__
        assert said and not said.startswith(f"{name}("), f"{name}: Python's own words are none"


def test_a_session_steps(own_styles):
    session = pw.Session(pw.load_controller(), pw.load_stylizer())
    for _ in range(30):
        frame = session.step(pw.Command(move=(0, 1), gait="walk", style={"arms": ("old", 0.8)}))
    assert frame.styled.positions.shape == (21, 3)
    assert not np.array_equal(frame.styled.rotations, frame.neutral.rotations)


def test_a_style_is_spelt_as_it_is_meant():
    assert pw.StyleSpec({"arms": "old"}) == pw.StyleSpec({"left_arm": "old", "right_arm": "old"})
    assert pw.StyleSpec({"spine": ("old", 0.5, "proud", 0.2)})["spine"] == ("old", 0.5, "proud", 0.2)
    with pytest.raises(ValueError, match="unknown body part 'tail'"):
        pw.StyleSpec({"tail": "old"})
    with pytest.raises(ValueError, match="strength of arms is 99"):
        pw.StyleSpec({"arms": ("old", 99)})


def test_the_ten_lines_of_the_front_door(own_styles, walk_file, tmp_path):
    controller, stylizer = pw.load_controller(), pw.load_stylizer()
    session = pw.Session(controller, stylizer)
    session.step(pw.Command(move=(0, 1), gait="walk", style={"arms": ("old", 0.8)}))
    stylizer.bank.add("limp", pw.load_clip(walk_file))
    pw.save_bvh(tmp_path / "out.bvh", pw.stylize(pw.load_clip(walk_file), {"legs": "limp"}, stylizer))
    assert len(pw.load_clip(tmp_path / "out.bvh")) == len(pw.load_clip(walk_file))
    assert "limp" in pw.load_stylizer().styles, "and kept for the next start"
    with pytest.raises(ValueError, match="style 'none' needs a clip"):
        stylizer.bank.add("none")


def test_the_page_of_the_library_is_that_of_its_docstrings():
    assert api.FILE.read_text(encoding="utf-8") == api.api_text(), "run `python -m demo.tools.api`"


def test_the_examples_run(own_styles, walk_file, tmp_path, capsys, monkeypatch):
    walk.main()
    assert "4 s:" in capsys.readouterr().out
    stylize_clip.main(str(walk_file), "old", str(tmp_path / "out.bvh"))
    assert len(pw.load_clip(tmp_path / "out.bvh")) == len(pw.load_clip(walk_file))
    register_style.main(str(walk_file), "mine")
    assert "cm from the neutral walk" in capsys.readouterr().out
    monkeypatch.setattr(crowd, "FRAMES", 10)
    crowd.main()
    assert capsys.readouterr().out.count(" m\n") == crowd.COUNT
    monkeypatch.setattr(train_controller, "train", lambda data, out, minutes: out / "pfnn.safetensors")
    train_controller.main("mocap", str(tmp_path), "1")
    assert "pfnn.safetensors" in capsys.readouterr().out
