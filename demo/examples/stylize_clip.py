"""Gives a clip the legs of a style: `python -m demo.examples.stylize_clip walk.bvh zombie out.bvh`."""

import sys

import patchwalk as pw


def main(content: str, style: str, output: str) -> None:
    stylizer = pw.load_stylizer()
    styled = pw.stylize(pw.load_clip(content), {"legs": style}, stylizer)
    pw.save_bvh(output, styled)
    print(f"wrote {output}: {len(styled)} frames")


if __name__ == "__main__":
    if len(sys.argv) <= 3:
        sys.exit(__doc__)
    main(*sys.argv[1:4])
