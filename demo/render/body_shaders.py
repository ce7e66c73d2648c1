"""The shaders of bodies, GLSL 3.30: skins whose corners come posed, lit, shaded by themselves, with smooth outlines.

Where light is added up, colours are squared first and the root of the sum is shown."""

from demo.render.shaders import VERSION

# Both kinds of skin are drawn by this one: `first` and `second` are the six numbers of Skin.materials.
BODY_VERTEX = (
    VERSION
    + """
layout(location = 0) in vec3 place;               // in the world
layout(location = 1) in vec3 direction;
layout(location = 2) in vec4 first;
layout(location = 3) in vec2 second;
layout(location = 4) in vec3 bind_place;
layout(location = 5) in float gone;               // share of the light that other limbs keep away
layout(location = 6) in float side;               // 1 on the outer side of the strip along the outline, else 0
uniform mat4 world_to_clip;
uniform mat4 world_to_light;
uniform vec2 half_size;                           // half the picture, in pixels
out vec3 world;
out vec3 normal;
out vec3 bind;
out vec3 lit_at;                                  // in the light's picture of the bodies, depth last
out vec2 shade;                                   // share of light that is gone; how much of a pixel is covered
out vec4 wear;
out vec2 more;

void main() {
    world = place;
    normal = direction;
    bind = bind_place;
    wear = first;
    more = second;
    shade = vec2(gone, 1.0 - side);
    lit_at = (world_to_light * vec4(place + direction * 0.018, 1.0)).xyz;
    vec4 clip = world_to_clip * vec4(place, 1.0), away = world_to_clip * vec4(direction, 0.0);
    vec2 outwards = (away.xy * clip.w - clip.xy * away.w) * half_size;
    clip.xy += side * clip.w / half_size * outwards / max(length(outwards), 1e-6);
    gl_Position = clip;
}
"""
)

# What both kinds of skin share: the light. A sun, a sky and the ground's bounce, a weak light from where the eye is,
# and a rim of sky where the body turns away; none of it where the body is in its own way.
LIGHT = (
    VERSION
    + """
uniform vec3 eye;
uniform vec3 to_light;
uniform vec3 plane;   // of the ground under the body: its height at the origin, its rise along x and z
uniform sampler2DShadow light_map;
uniform vec2 softness;  // half the width of a shadow's edge in it
in vec3 world;
in vec3 normal;
in vec3 bind;
in vec3 lit_at;
in vec2 shade;
in vec4 wear;
in vec2 more;
out vec4 pixel;
const vec2 TAPS[6] = vec2[](vec2(0.35, 0.20), vec2(-0.35, 0.20), vec2(0.0, -0.40),
                            vec2(0.0, 0.95), vec2(-0.82, -0.48), vec2(0.82, -0.48));

vec4 lit(vec3 base, float openness, float gloss) {
    vec3 n = normalize(normal), v = normalize(eye - world);
    float facing = max(dot(n, v), 0.0), lambert = dot(n, to_light);
    float sun = 0.0;
    if (lambert > 0.0)
        for (int tap = 0; tap < 6; tap++) sun += texture(light_map, lit_at + vec3(TAPS[tap] * softness, 0.0)) / 6.0;
    float open = openness * (1.0 - shade.x);
    float height = world.y - plane.x - dot(plane.yz, world.xz);
    open *= 0.72 + 0.28 * clamp(height * 1.2 + 0.1, 0.0, 1.0);           // close to the ground less light comes in
    float up = 0.5 + 0.5 * n.y;
    vec3 around = mix(vec3(0.175, 0.155, 0.140), vec3(0.40, 0.47, 0.57), up * up) + 0.11 * facing;
    vec3 light = vec3(1.24, 1.10, 0.92) * (max(lambert, 0.0) * sun * (0.35 + 0.65 * open)) + around * open;
    float rim = 1.0 - facing;
    rim *= rim * rim * open * open * up * up;
    vec3 halfway = normalize(v + to_light);
    float gleam = max(dot(n, halfway), 0.0);
    gleam *= gleam; gleam *= gleam; gleam *= gleam; gleam *= gleam;
    vec3 sum = base * light + rim * vec3(0.18, 0.22, 0.28) + gloss * gleam * max(lambert, 0.0) * sun;
    return vec4(sqrt(sum * (1.10 / (1.0 + 0.20 * sum))), shade.y);
}
"""
)

# The figure's own skin: first the shares of left leg, right leg, left arm and right arm, the rest being spine, then
# that of gloves and shoes and the openness.
FIGURE_FRAGMENT = (
    LIGHT
    + """
uniform vec4 tints[5];  // display colour of each body part
uniform vec3 visor;     // the middle of the dark visor in the bind pose

void main() {
    float limb = wear.x + wear.y + wear.z + wear.w;
    vec3 tint = (tints[0].rgb * wear.x + tints[1].rgb * wear.y + tints[3].rgb * wear.z + tints[4].rgb * wear.w)
              / max(limb, 1e-3);
    // Where a share passes a half one cloth ends and the next begins, with a seam between them.
    vec2 share = vec2(limb, more.x);
    vec2 grain = max(fwidth(share), 1e-4);
    vec2 past = (share - 0.5) / grain;                                   // pixels from the seam
    tint = mix(tints[2].rgb, tint, clamp(past.x + 0.5, 0.0, 1.0));
    vec3 base = tint * tint * (1.0 - 0.66 * clamp(past.y + 0.5, 0.0, 1.0));
    vec2 wide = max(0.060 / grain, vec2(0.6));
    vec2 seam = clamp(wide + 0.5 - abs(past), 0.0, 1.0) * min(0.12 / grain, vec2(1.0));
    base *= 1.0 - 0.5 * max(seam.x, seam.y);
    vec3 off = (bind - visor) * vec3(15.0, 34.0, 15.0);
    float glass = clamp((1.0 - dot(off, off)) * 9.0, 0.0, 1.0);
    base = mix(base, vec3(0.006, 0.008, 0.013), glass);
    pixel = lit(base, mix(0.40, 1.0, more.y), 0.06 + 0.6 * glass);
}
"""
)

# A skin with colours of its own: first its display colour and openness, then where it is in its picture.
PAINTED_FRAGMENT = (
    LIGHT
    + """
uniform sampler2D picture;
void main() {
    vec4 painted = texture(picture, more);
    if (painted.a < 0.5) discard;
    vec3 tint = wear.rgb * painted.rgb;
    pixel = lit(tint * tint, mix(0.40, 1.0, wear.a), 0.06);
}
"""
)

# A body that one can see through: its outline more than its inside.
GHOST_FRAGMENT = (
    VERSION
    + """
uniform vec4 tints[5];
uniform vec3 eye;
uniform float opacity;
in vec3 world;
in vec3 normal;
in vec2 shade;
out vec4 pixel;
void main() {
    float rim = 1.0 - abs(dot(normalize(normal), normalize(eye - world)));
    pixel = vec4(tints[2].rgb * (0.80 + 0.20 * normal.y), shade.y * opacity * (0.22 + 0.78 * rim * rim));
}
"""
)

# ---- what the light sees: the bodies' depth ------------------------------------------------------------------

DEPTH_VERTEX = (
    VERSION
    + """
layout(location = 0) in vec3 place;
layout(location = 1) in vec3 direction;
uniform mat4 world_to_light;
void main() {
    vec4 at = world_to_light * vec4(place - direction * 0.010, 1.0);  // thinner: the coarse skin shades the fine one
    gl_Position = vec4(at.xyz * 2.0 - 1.0, 1.0);
}
"""
)

DEPTH_FRAGMENT = VERSION + "void main() {}\n"

# ---- shadow: the body flattened along the light into a small picture of the ground --------------------------

SHADOW_VERTEX = (
    VERSION
    + """
layout(location = 0) in vec3 place;
uniform vec3 to_light;
uniform vec3 area;   // centre x, z and half width of the ground in the picture
uniform vec3 plane;  // that the shadow falls on: its height at the origin, its rise along x and z
out float height;

void main() {
    height = place.y - plane.x - dot(plane.yz, place.xz);
    vec2 ground = place.xz - to_light.xz * (height / (to_light.y - dot(plane.yz, to_light.xz)));
    gl_Position = vec4((ground - area.xy) / area.z, 0.0, 1.0);
}
"""
)

SHADOW_FRAGMENT = (
    VERSION
    + """
in float height;
out vec4 pixel;
void main() { pixel = vec4(clamp(0.62 - 0.20 * height, 0.0, 1.0)); }  // what is high up casts a weaker shadow
"""
)
