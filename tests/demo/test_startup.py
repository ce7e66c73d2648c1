"""What a session imports before its first frame, and how many threads it takes."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = """
import json, sys
from demo import assemble
from sim.command import Command
session = assemble.build_session()
session.step(Command(style={"spine": (session.stylizer.styles[0], 1.0)}))
import os, torch
threads = len(os.listdir("/proc/self/task")) if os.path.isdir("/proc/self/task") else 1
print(json.dumps([sorted({name.split(".")[0] for name in sys.modules}), torch.get_num_threads(), threads]))
"""
NEEDLESS = {"scipy", "matplotlib", "pygame", "OpenGL", "imageio_ffmpeg", "pytest"}


def test_a_session_imports_only_what_it_needs_and_runs_on_one_thread():
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", SCRIPT], cwd=root, capture_output=True, text=True, check=True)
    modules, torch_threads, threads = json.loads(done.stdout)
    assert not NEEDLESS & set(modules)
    assert torch_threads == threads == 1


BY_HAND = """
import torch
from controller.runtime.controller import PhaseFunctionedController
from stylizer.runtime.catalogue import make_stylizer
from stylizer.styles.bank import StyleBank
torch.set_num_threads(2)
{}
print(torch.get_num_threads())
"""


@pytest.mark.parametrize("made", ["make_stylizer(StyleBank())", "PhaseFunctionedController.from_pretrained()"])
def test_a_model_that_is_built_by_hand_runs_on_one_thread_too(made):
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", BY_HAND.format(made)], cwd=root, capture_output=True, text=True)
    assert done.stdout.strip() == "1", done.stderr
