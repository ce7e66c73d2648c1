"""The network's weights by phase, computed in advance, against the network itself."""

import copy
import math

import numpy as np
import torch

from controller.model import checkpoint
from controller.model.io_layout import INPUT_SIZE, OUTPUT_SLICES
from controller.model.network import PhaseFunctionedNetwork
from controller.model.phase_table import PhaseTable
from controller.runtime.controller import PhaseFunctionedController
from sim.command import Command

PHASES = np.linspace(0, 2 * math.pi, 97, endpoint=False)


def both(
    network: PhaseFunctionedNetwork, inputs: np.ndarray, phases: np.ndarray, **options
) -> tuple[np.ndarray, np.ndarray]:
    """Answers of the network and of its table."""
    table = PhaseTable(network, **options)
    with torch.inference_mode():
        exact = network(torch.from_numpy(inputs), torch.tensor(phases, dtype=torch.float32)).numpy()
    return exact, np.array([table(x, phase) for x, phase in zip(inputs, phases)])


def test_the_shipped_network_and_its_table_put_the_joints_in_the_same_place():
    """On what the controller really asks: half-precision weights move the joints as much."""
    network, controller, asked = checkpoint.load(), PhaseFunctionedController.from_pretrained(), []
    table = controller.network
    controller.network = lambda x, phase: (asked.append((x.copy(), phase)), table(x, phase))[1]
    for frame in range(240):
        controller.step(Command((math.sin(frame / 40), math.cos(frame / 40)), gait="run" if frame > 120 else "walk"))
    exact, ours = both(network, np.array([x for x, _ in asked]), np.array([phase for _, phase in asked]))
    apart = (ours - exact)[:, OUTPUT_SLICES["positions"]].reshape(-1, 3)
    assert np.sqrt((apart**2).sum(axis=1).mean()) < 2e-4 and np.abs(apart).max() < 1e-3  # metres


def test_more_entries_come_nearer_and_the_cycle_closes():
    torch.manual_seed(0)
    network = PhaseFunctionedNetwork(hidden=16).eval()
    inputs = np.tile(torch.randn(INPUT_SIZE).numpy(), (len(PHASES), 1))
    coarse, fine = (np.std(np.subtract(*both(network, inputs, PHASES, entries=entries))) for entries in (16, 64))
    assert fine < coarse / 10
    table = PhaseTable(network)
    np.testing.assert_allclose(table(inputs[0], 2 * math.pi - 1e-9), table(inputs[0], 0.0), atol=1e-5)
    steps = np.abs(np.diff([table(inputs[0], phase) for phase in np.linspace(0, 1, 2000)], axis=0)).max(axis=1)
    assert steps.max() < 20 * np.median(steps)  # no leap from one entry to the next


def test_copies_of_a_character_share_the_table():
    table = PhaseTable(PhaseFunctionedNetwork(hidden=8))
    assert copy.deepcopy([table])[0] is table
