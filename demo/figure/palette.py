"""The colours of the styles: one for each bundled style, chosen to be told apart, and some for the user's own."""

# Of 35 colours the least two are 24 apart in CIELAB, and none is nearer than that to a part without a style or to the
# neutral twin. Where a style suggests a colour (angry, sad, soldier), it is the nearest of them.
BUNDLED = {
    "active": "00b487",
    "angry": "d20f1e",
    "bouncy": "ffc3e1",
    "carrying": "b47800",
    "childish": "ff960f",
    "chimpira": "b41eb4",
    "crouching": "786900",
    "elderly": "87694b",
    "exhausted": "786996",
    "feminine": "b47887",
    "giant": "1e785a",
    "happy": "e1e11e",
    "hunched": "785ae1",
    "hurrying": "d2785a",
    "leaning": "4bb4b4",
    "lunging": "ff4b69",
    "marching": "ffb4a5",
    "masculine": "0069d2",
    "musical": "e187ff",
    "neutral": "b4e1c3",
    "not-confident": "c3c3ff",
    "old": "b4b469",
    "proud": "c32d69",
    "prowling": "007896",
    "pushing": "b44b00",
    "sad": "0096e1",
    "skipping": "00f096",
    "slouching": "879678",
    "soldier": "4b780f",
    "strutting": "ffc31e",
    "swaggering": "ff3cb4",
    "tiptoeing": "00f0e1",
    "tired": "69d2ff",
    "youthful": "87d23c",
    "zombie": "00a51e",
}
# Of the user's own styles and of sampled ones, by their names: at least 16 from each other and from those above.
OTHERS = (
    "f0d2a5 ff87a5 879600 b469b4 c39669 c396c3 f06900 9687d2 c3a50f 78b469 4b7878 c3e196 b45a5a 6996ff 00873c 00a5c3 "
    "ffb478 5ae1f0 ff87d2 f0b4ff 965a87 87874b e14b1e"
).split()
