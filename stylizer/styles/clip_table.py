"""Which clips each style that comes with Patchwalk is computed from, and their licences."""

from typing import Sequence

from sim.io.provenance import ARCHIVES

SET_1 = ("run_{}_001", "dash_{}_001", "walk-back_{}_001", "walk-left_{}_001", "walk-right_{}_001")  # besides the walk
# takes of the run
SET_2 = {"active": "042", "elderly": "019", "exhausted": "038", "masculine": "007", "youthful": "004"}

# name: clips in the data folder, archive/file.bvh, or archive/file.bvh@from-to for some seconds of a longer one; the
# first one walks straight ahead, in what the labels say
CLIPS: dict[str, tuple[str, ...]] = {
    **{
        name: (
            f"bandai-namco/dataset-1_walk_{name}_{take}.bvh",
            *(f"bandai-namco/dataset-1_{clip.format(name)}.bvh" for clip in SET_1),
        )
        for name, take in {
            "angry": "002",
            "childish": "001",
            "chimpira": "002",
            "feminine": "001",
            "giant": "002",
            "happy": "001",
            "musical": "001",
            "not-confident": "001",
            "old": "002",
            "proud": "001",
            "sad": "002",
            "tired": "001",
        }.items()
    },
    **{
        name: (f"bandai-namco/dataset-2_walk_{name}_{take}.bvh", f"bandai-namco/dataset-2_run_{name}_{SET_2[name]}.bvh")
        for name, take in {
            "active": "017",
            "elderly": "009",
            "exhausted": "012",
            "masculine": "013",
            "youthful": "014",
        }.items()
    },
    **{
        name: (f"snu-styles/wd2_Walk{label}.bvh",)
        for name, label in {
            "soldier": "Soldier01",
            "marching": "Azuma01",
            "hunched": "Sukiko01",
            "bouncy": "TongTong01",
            "leaning": "Lean01",
        }.items()
    },
    "carrying": ("accad/Female1_B20_WalkWithBox.bvh",),
    "crouching": ("o3de/Crouching1.bvh@3.0-28.0", "o3de/Crouching1.bvh@31.0-49.5"),
    "hurrying": ("snu-biped/woddy2_walk_straight_very_fast.bvh@12.5-15.0",),
    "lunging": tuple(f"snu-biped/woddy2_wide_ext_walk1.bvh@{part}" for part in ("6.0-8.9", "11.2-14.0", "17.0-20.0")),
    "prowling": ("snu-biped/woddy2_low_walk.bvh@63.5-68.8",),
    "pushing": ("cc0-quaternius/Push_Loop.bvh",),
    "skipping": ("accad/Female1_A14_StandToSkip.bvh@1.5-4.0", "accad/Female1_A13_Skipping.bvh"),
    "slouching": tuple(f"snu-biped/woddy2_walk_normal_style_4.bvh@{part}" for part in ("15.0-19.0", "8.0-11.5")),
    "strutting": tuple(f"snu-biped/woddy2_walk_normal_style_2.bvh@{part}" for part in ("9.3-13.5", "17.0-21.5")),
    "swaggering": ("cmu131/131_01.bvh@4.3-6.1",),
    "tiptoeing": ("cmu131/131_02.bvh@2.5-8.5",),
    "zombie": ("zombie/zombie.bvh@2.5-11.5",),
}


def licence_of(clips: Sequence[str]) -> str:
    """Who made the clips of a style, and the licence."""
    return ARCHIVES[clips[0].partition("/")[0]]
