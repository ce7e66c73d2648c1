"""The one place where the two models meet the body and become a session."""

import copy
import gc
from pathlib import Path

# torch makes a hundred thousand objects, all to stay: walking them while they come costs a fifth of the start
gc.disable()
import torch  # noqa: E402

from controller.runtime.controller import PhaseFunctionedController  # noqa: E402
from sim.ground.ground import Ground  # noqa: E402
from sim.latency import Latency  # noqa: E402
from sim.protocols import NamedStylizer  # noqa: E402
from sim.session import Session  # noqa: E402
from stylizer.runtime import catalogue  # noqa: E402
from stylizer.runtime.live import LiveStylizer  # noqa: E402

gc.freeze()
gc.enable()

BUNDLED_RECORDING = Path(__file__).parent / "recordings" / "demo.jsonl"


def build_session(
    stylizer: str | None = None,
    latency: Latency | None = None,
    weights: Path | None = None,
    ground: Ground | None = None,
) -> Session[NamedStylizer]:
    """A session with trained weights, `stylizer` naming the style-transfer system's (None: the shipped Motion Puzzle),
    from a folder that `patchwalk train stylizer` wrote (None: the package), on a ground (None: level floor).

    Raises ValueError or OSError, in one sentence, where weights are missing, made for something else, or where the
    stylizer's own style is not that of the controller."""
    session: Session[NamedStylizer] = Session(
        PhaseFunctionedController.from_pretrained(), catalogue.from_pretrained(stylizer, weights), latency, ground
    )
    gc.collect()
    gc.freeze()  # what start-up left is here to stay: the collector need not walk it between two frames
    return session


def another_session(session: Session[NamedStylizer]) -> Session[NamedStylizer]:
    """Another character with the weights and the styles of a session that `build_session` made, at the start point, in
    a hundredth of the time and memory. Styles that are drawn by chance are its own."""
    stylizer = session.stylizer
    assert isinstance(stylizer, LiveStylizer)
    shared = (
        catalogue.make_stylizer(stylizer.bank) if stylizer.seed is None else catalogue.from_pretrained(stylizer.name)
    )
    controller = copy.deepcopy(session.controller)  # all but the network, which is shared
    controller.restart()
    return Session(controller, shared, ground=session.ground)


def machine() -> dict:
    """What the latency report says of this process besides processor and cores."""
    return {"threads": torch.get_num_threads(), "torch": torch.__version__}
