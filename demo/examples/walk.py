"""Walks ahead for two seconds with zombie arms, then turns right in a run. Prints where the character comes to."""

import patchwalk as pw

SECONDS, FPS = 4, 60


def main() -> None:
    session = pw.Session(pw.load_controller(), pw.load_stylizer())
    style = pw.StyleSpec({"arms": ("zombie", 0.8), "spine": "leaning"})
    for frame in range(SECONDS * FPS):
        walking = frame < 2 * FPS
        command = pw.Command(move=(0, 1) if walking else (-1, 0), gait="walk" if walking else "run", style=style)
        styled = session.step(command).styled
        if frame % FPS == FPS - 1:
            x, _, z = styled.root_position
            print(f"{(frame + 1) // FPS} s: {z:.2f} m ahead, {-x:.2f} m to the right")


if __name__ == "__main__":
    main()
