"""What the table of transfer does not show: how much of a style arrives in each part, locality, reconstruction,
strength 0, and the live stream while styles are switched."""

from functools import cache
from typing import Callable, Sequence

import numpy as np

from sim.body.skeleton import PART_NAMES, TOES
from sim.motion.clip import FPS, Clip, root_frame
from sim.motion.feature_window import SPAN
from sim.motion.features import LAYOUT, clip_features
from sim.motion.metrics import foot_skate
from stylizer.data.style_labels import Take
from stylizer.evaluation import metrics as measures
from stylizer.evaluation.playback import Playback, Styles, play_live
from stylizer.evaluation.transfer_benchmark import CENTI
from stylizer.runtime.offline import ResolvedStyle, encode_clip, stylize
from stylizer.styles.own_style import OWN
from stylizer.systems.motion_puzzle.model import MotionPuzzle

LONGEST = 240  # frames of a clip that are played
SETTLED = 45  # frames after which a live stream has reached its strength
NEUTRAL = "normal"  # the label of motion without a style
REBUILT = 8  # clips
SWITCH_EVERY = FPS  # frames

Tick = Callable[[], object]


class Further:
    """The further figures of one network over takes of labelled motion. Each method is one of them."""

    def __init__(self, model: MotionPuzzle, takes: Sequence[Take]) -> None:
        self.model = model
        walks = [take for take in takes if take.content == "walk" and len(take.clip) > 2 * SETTLED]
        self.neutral = {take.style: take for take in walks if take.style.startswith(NEUTRAL)}  # by performer
        self.styled = list({take.style: take for take in walks if not take.style.startswith(NEUTRAL)}.values())
        self.style = cache(lambda take: encode_clip(model, take.features))
        if not (self.neutral and self.styled):
            raise ValueError(
                f"the labelled motion holds no walk that is '{NEUTRAL}', or none that is not: give all of it"
            )

    def all(self, tick: Tick) -> dict:
        """Every figure by name; calls tick once each."""
        result = {}
        for figure in (self.arrives, self.locality, self.reconstruction, self.strength_0, self.switching):
            result[figure.__name__] = figure()
            tick()
        return result

    def arrives(self) -> dict:
        """Statistic -> part -> the shares of the style's that arrive (metrics.shares), offline and live, from neutral
        walks to every style of the same performer walking."""
        gaps = {mode: {name: np.zeros(()) for name in measures.STATISTICS} for mode in ("offline", "live")}
        for target in self.styled:
            source = self._neutral_like(target)
            content = source.clip[:LONGEST]
            outputs = {
                "offline": stylize(
                    self.model, content, {part: ResolvedStyle(self.style(target)) for part in PART_NAMES}
                ),
                "live": self._live(content, source, target, PART_NAMES).locked,
            }
            for mode, output in outputs.items():
                for name, statistic in measures.STATISTICS.items():
                    motions = (clip_features(output)[SETTLED:], clip_features(content)[SETTLED:], target.features)
                    gaps[mode][name] = gaps[mode][name] + measures.part_distances(*map(statistic, motions))
        return {mode: {name: measures.shares(gap) for name, gap in by_name.items()} for mode, by_name in gaps.items()}

    def locality(self) -> dict:
        """Mode -> restyled part -> part -> mean over its joints of the displacement relative to the hips, over the
        height (Table 1), for the style whose mean pose in the restyled part is the farthest from the neutral one."""
        result: dict = {"offline": {}, "live": {}}
        for index, part in enumerate(PART_NAMES):
            farthest = np.argmax([self._distance(take)[index] for take in self.styled])
            target = self.styled[farthest]
            source = self._neutral_like(target)
            content = source.clip[:LONGEST]
            pairs = {
                "offline": (stylize(self.model, content, {part: ResolvedStyle(self.style(target))}), content),
                "live": [self._live(content, source, target, worn).locked for worn in ((part,), ())],
            }
            for mode, (output, unstyled) in pairs.items():
                moved = measures.joint_displacement(output.positions()[SETTLED:], unstyled.positions()[SETTLED:])
                result[mode][part] = {"style": target.style, **measures.by_part(moved)}
        return result

    def _distance(self, target: Take) -> np.ndarray:
        """(5,) how far the mean pose of each part is from the neutral one."""
        neutral, styled = (measures.mean_pose(take.features) for take in (self._neutral_like(target), target))
        return measures.part_distances(neutral, neutral, styled)[measures.GAP]

    def reconstruction(self) -> dict:
        """Mean joint error in centimetres, in the character's own frame, of clips restyled in their own style, offline
        and in the live stream's last frames."""
        errors: dict = {"offline_cm": [], "live_cm": []}
        for take in [*self.neutral.values(), *self.styled][:REBUILT]:
            content = take.clip[:LONGEST]
            outputs = {
                "offline_cm": stylize(
                    self.model, content, {part: ResolvedStyle(self.style(take)) for part in PART_NAMES}
                ),
                "live_cm": self._live(content, take, take, PART_NAMES).styled,
            }
            for mode, output in outputs.items():
                errors[mode].append(
                    measures.joint_error(
                        *(clip_features(clip)[SETTLED:, :, LAYOUT["position"]] for clip in (output, content))
                    )
                )
        return {mode: CENTI * float(np.mean(values)) for mode, values in errors.items()}

    def strength_0(self) -> dict:
        """How far the live pose at strength 0 is from the neutral one, at most over all joints and frames."""
        source = next(iter(self.neutral.values()))
        content = source.clip[:LONGEST]
        playback = self._live(content, source, self.styled[0], PART_NAMES, strength=0.0)
        return {"farthest_cm": CENTI * float(np.abs(playback.styled.positions() - content.positions()).max())}

    def switching(self) -> dict:
        """The live stream over every neutral walk while its style is switched each second: jerk before and after the
        foot lock over the content's, and foot skate beside that of the content after the lock, in centimetres a
        second."""
        names = [take.style for take in self.styled]
        jerks, skates = [], []

        def changing(frame: int) -> dict:
            return {part: (names[(frame // SWITCH_EVERY) % len(names)], 1.0) for part in PART_NAMES}

        for source in self.neutral.values():
            content = source.clip
            styles = Styles(
                self.model, {take.style: self.style(take) for take in self.styled} | {OWN: self.style(source)}
            )
            playback, unstyled = play_live(styles, content, changing), play_live(styles, content, lambda _: {})
            root = root_frame(content.positions()).positions[SPAN:]
            positions = [
                clip.positions()[SPAN:] for clip in (playback.styled, playback.locked, unstyled.locked, content)
            ]
            jerks.append([measures.jerk_ratio(ours, positions[-1], root) for ours in positions[:-1]])
            skates.append([np.nanmean(foot_skate(p[:, TOES])) for p in positions[1:3]])
        jerk_names = ("jerk_ratio_before_lock", "jerk_ratio_after_lock", "jerk_ratio_unstyled_after_lock")
        skate_names = ("skate_cm_s", "unstyled_skate_cm_s")
        return {
            **dict(zip(jerk_names, np.mean(jerks, axis=0).tolist())),
            **dict(zip(skate_names, (CENTI * np.mean(skates, axis=0)).tolist())),
        }

    def _neutral_like(self, target: Take) -> Take:
        """A neutral walk of the same performer, or of another where there is none."""
        return self.neutral.get(f"{NEUTRAL} {target.style.split()[-1]}", next(iter(self.neutral.values())))

    def _live(self, content: Clip, source: Take, target: Take, parts: Sequence[str], strength: float = 1.0) -> Playback:
        styles = Styles(self.model, {OWN: self.style(source), "target": self.style(target)})
        return play_live(styles, content, lambda _: {part: ("target", strength) for part in parts})
