"""Sixteen characters in one session, each in a style of its own: a batch costs a fraction of as many sessions."""

import patchwalk as pw

COUNT, FRAMES = 16, 120


def main() -> None:
    session = pw.Session(pw.load_controller(), pw.load_stylizer())
    names = session.stylizer.styles
    crowd = session.crowd(COUNT)
    commands = pw.Commands([pw.Command(move=(0, 1), style={"all": names[one % len(names)]}) for one in range(COUNT)])
    for _ in range(FRAMES):
        frame = crowd.step(commands)
    for one in range(COUNT):
        print(f"{names[one % len(names)]}: {frame.styled.root_position[one, 2]:.2f} m")


if __name__ == "__main__":
    main()
