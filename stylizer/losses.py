"""What training asks of the network: Eq. 15 to 19 of Motion Puzzle, and what measurement added to them."""

import numpy as np
import torch
from torch import Tensor

from sim.features import LAYOUT, STRIDE, WINDOW
from sim.skeleton import CONTACT_JOINTS, GROUPS, JOINT_COUNT, PART_NAMES, PART_OF_JOINT
from stylizer.dataset import LATER
from stylizer.motion_puzzle import MotionPuzzle, PartStyle, mix_parts

# Weight of each term; the live stylizer shows the last sample only, hence LAST_WEIGHT on the last two.
WEIGHTS = {"reconstruction": 1.0, "root": 0.5, "smoothness": 1.0, "posture": 1.5, "stream": 1.5}
LAST_WEIGHT = 5.0
BODY = slice(LAYOUT["position"].start, LAYOUT["rotation"].stop)  # position and rotation
SPEED_SCALE = 1.0  # m/s; clips whose speeds differ by more have little to say about each other's dynamics
STANDING, WALKING = 0.15, 0.45  # m/s, mean root speed of a clip under and over which it surely stands or walks
FEET = np.isin(np.arange(JOINT_COUNT), CONTACT_JOINTS)
LEGS = np.isin(PART_OF_JOINT, [PART_NAMES.index(part) for part in GROUPS["legs"]])


def losses(model: MotionPuzzle, source: Tensor, later: Tensor, target: Tensor, use_target: Tensor) -> dict[str, Tensor]:
    """One training pass. source, target: (B, 32, 21, 15); later: (B, 16, 21, 15), the content window LATER frames on;
    use_target: (5, B) bool, the parts that take the target's style (Alg. 1)."""
    source, later, target = map(model.normalize, (source, later, target))  # (21, B, T, 15)
    now = source[:, :, -WINDOW:]
    size = now.shape[1]

    styles = model.encode_style(torch.cat([source, target], dim=1))
    own, other = _halves(styles, size)
    mixed = mix_parts(own, other, use_target)
    content = model.content_encoder(torch.cat([now, later], dim=1))
    output = model.decoder(torch.cat([content, content], dim=1), _joined([own, own, mixed, mixed])).float()
    rebuilt, rebuilt_later, restyled, restyled_later = output.chunk(4, dim=1)

    wanted = torch.cat([now, later], dim=1)
    time = torch.ones(WINDOW, 1)
    time[-2:] = LAST_WEIGHT
    time = (time / time.mean()).to(now.device)
    newest = slice(-2, None)
    known = _seen_later(restyled_later).detach()[:, :, newest]  # later, these samples lie well inside the window
    return {
        "reconstruction": ((output[:, :2 * size] - wanted).abs() * time).mean(),  # Eq. 15
        "root": ((restyled - now)[..., LAYOUT["root"]].abs() * time).mean(),  # Eq. 17
        "smoothness": (output[:, :2 * size] - wanted)[..., BODY].diff(dim=2).abs().mean(),  # Eq. 18, 19
        "posture": posture(restyled, now, source, target, use_target, model),
        "stream": (restyled[:, :, newest] - known)[..., BODY].abs().mean(),
    }


def posture(restyled: Tensor, content: Tensor, source: Tensor, target: Tensor, use_target: Tensor,
            model: MotionPuzzle) -> Tensor:
    """The restyled parts' mean and deviation over time, per joint, should differ as the target's and the source's do.

    A difference of whole cycles, because half a second is half a stride: its own mean depends on which leg is in front.
    How clips at different speeds move says less about style, so they count less; and where one walks and the other
    stands, feet stay as flat and legs as quiet (or lively) as they are."""
    speed = [(m[0] * model.deviation[0, 0] + model.mean[0, 0])[..., LAYOUT["root"]][..., :2].norm(dim=-1).mean(-1)
             for m in (source, target)]
    alike = torch.exp(-((speed[0] - speed[1]) / SPEED_SCALE) ** 2)[None, :, None]  # (1, B, 1)
    walking = [((v - STANDING) / (WALKING - STANDING)).clamp(0, 1) for v in speed]
    same_gait = 1 - (walking[0] - walking[1]).abs()[None, :, None]
    feet, legs = (torch.as_tensor(joints, device=source.device)[:, None, None] for joints in (FEET, LEGS))

    mean_shift = target[..., BODY].mean(2) - source[..., BODY].mean(2)  # (21, B, 9)
    mean_shift = torch.where(feet, same_gait, 1.0) * mean_shift
    deviation_shift = torch.where(legs, same_gait, 1.0) * (_deviation(target) - _deviation(source))
    mean_error = (restyled[..., BODY].mean(2) - content[..., BODY].mean(2) - mean_shift).abs()
    deviation_error = (_deviation(restyled) - (_deviation(content) + deviation_shift).clamp(min=0)).abs()

    chosen = use_target[torch.as_tensor(PART_OF_JOINT, device=use_target.device)][..., None]  # (21, B, 1)
    error = ((0.5 + 0.5 * alike) * mean_error + alike * deviation_error) * chosen
    return error.sum() / (chosen.sum() * error.shape[2]).clamp(min=1)


def _seen_later(later: Tensor) -> Tensor:
    """What a window that ends LATER frames on tells of this window's last samples: (21, B, T, 15) -> (.., T', 15).

    LATER is odd, so its samples fall between ours: cubic interpolation, which keeps even and odd frames of a stream together."""
    between = (9 * (later[:, :, 1:-2] + later[:, :, 2:-1]) - (later[:, :, :-3] + later[:, :, 3:])) / 16
    after = (LATER - 1) // STRIDE - 1  # of those, the ones that lie after our last sample
    return between[:, :, :-after] if after else between


def _deviation(motion: Tensor) -> Tensor:
    """(21, B, T, 15) -> (21, B, 9) deviation over time of position and rotation."""
    return (motion[..., BODY].var(dim=2, correction=0) + 1e-6).sqrt()


def _halves(styles: dict[int, PartStyle], size: int) -> tuple[dict[int, PartStyle], dict[int, PartStyle]]:
    return tuple({level: PartStyle(*(t[:, half] for t in style)) for level, style in styles.items()}
                 for half in (slice(size), slice(size, None)))


def _joined(styles: list[dict[int, PartStyle]]) -> dict[int, PartStyle]:
    return {level: PartStyle(*(torch.cat(ts, dim=1) for ts in zip(*(s[level] for s in styles)))) for level in styles[0]}
