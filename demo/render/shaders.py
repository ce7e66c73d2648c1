"""The shaders of sky, ground, marks, lines and panels, GLSL 3.30; those of bodies are in
demo.render.body_shaders."""

VERSION = "#version 330 core\n"

# ---- shadow: its picture is blurred -------------------------------------------------------------------------

FULL_VERTEX = (
    VERSION
    + """
out vec2 uv;
void main() {
    uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(uv * 2.0 - 1.0, 1.0, 1.0);
}
"""
)

BLUR_FRAGMENT = (
    VERSION
    + """
uniform sampler2D picture;
uniform vec2 texel;  // one step along the direction of this pass
in vec2 uv;
out vec4 pixel;
void main() {
    // Seven taps of a binomial row, read as four between texels.
    pixel = (texture(picture, uv - 2.4 * texel) + texture(picture, uv + 2.4 * texel)) * 0.15
          + (texture(picture, uv - 0.7 * texel) + texture(picture, uv + 0.7 * texel)) * 0.35;
}
"""
)

# ---- ground and sky -----------------------------------------------------------------------------------------

SKY = """
const vec3 HORIZON = vec3(0.872, 0.896, 0.914);
const vec3 ZENITH = vec3(0.38, 0.545, 0.72);
"""

SKY_VERTEX = (
    VERSION
    + """
uniform float horizon;  // where it is in the picture, in clip units: only what lies above is sky
uniform vec2 slope;     // sine of the elevation in the middle of the picture and its growth from there to the top
out float up;
void main() {
    float y = mix(max(horizon, -1.0), 1.0, float(gl_VertexID >> 1));
    up = (slope.x + slope.y * y) * 1.7;
    gl_Position = vec4(float(gl_VertexID & 1) * 2.0 - 1.0, y, 1.0, 1.0);
}
"""
)

SKY_FRAGMENT = (
    VERSION
    + SKY
    + """
in float up;
out vec4 pixel;
void main() {
    float high = clamp(up, 0.0, 1.0);
    pixel = vec4(mix(HORIZON, ZENITH, high * (2.0 - high)), 1.0);
}
"""
)

FLAT_GROUND_VERTEX = (
    VERSION
    + """
uniform mat4 world_to_clip;
uniform vec3 focus;  // under the camera's target
const float GROUND_REACH = 100.0;  // metres: the haze has long closed over it
out vec2 world;
out float light;
void main() {
    vec2 corner = 2.0 * vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) - 1.0;  // of one large triangle
    world = focus.xz + GROUND_REACH * corner;
    light = 1.0;
    gl_Position = world_to_clip * vec4(world.x, 0.0, world.y, 1.0);
}
"""
)

# Each pass over the uneven ground must find the very depths of the one before.
UNEVEN_GROUND = (
    VERSION
    + """
layout(location = 0) in vec4 corner;  // place, light
uniform mat4 world_to_clip;
invariant gl_Position;
"""
)

UNEVEN_GROUND_VERTEX = (
    UNEVEN_GROUND
    + """
out vec2 world;
out float light;
void main() {
    world = corner.xz;
    light = corner.w;
    gl_Position = world_to_clip * vec4(corner.xyz, 1.0);
}
"""
)

GROUND_FRAGMENT = (
    VERSION
    + SKY
    + """
uniform vec3 focus;
in vec2 world;
in float light;  // 1 on level ground
out vec4 pixel;

// How much of a pixel lies on lines `width` wide at every whole number, with `density` pixels to 1: where lines crowd,
// their mean.
float lines(vec2 p, vec2 density, float width) {
    vec2 away = abs(fract(p - 0.5) - 0.5);
    vec2 covered = clamp((width - away) * density + 0.5, 0.0, 1.0) * min(width * 2.0 * density, 1.0);
    return max(covered.x, covered.y);
}

void main() {
    vec2 from_focus = world - focus.xz;
    float distance = dot(from_focus, from_focus);
    vec2 density = 1.0 / fwidth(world);
    float marks = 0.050 * lines(world, density, 0.010) + 0.085 * lines(world * 0.2, density * 5.0, 0.0035);
    // Tiles of a metre, light and dark in turn; where a pixel holds several, their mean.
    vec2 tile = clamp((abs(fract(world * 0.5 + 0.25) - 0.5) - 0.25) * density * 2.0, -1.0, 1.0);
    marks += 0.011 * tile.x * tile.y * clamp(min(density.x, density.y) * 0.2 - 0.3, 0.0, 1.0);
    vec3 ground = mix(vec3(0.640, 0.680, 0.715), vec3(0.755, 0.775, 0.790), 1.0 / (1.0 + distance * 0.05));
    pixel = vec4(mix(HORIZON, (ground - marks) * light, 1.0 / (1.0 + distance * distance * 6e-5)), 1.0);
}
"""
)

FLAT_SHADE_VERTEX = (
    VERSION
    + """
uniform mat4 world_to_clip;
uniform vec3 area;  // centre x, z and half width of the ground in the shadow's picture
out vec2 uv;
void main() {
    uv = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 world = area.xy + area.z * (uv * 2.0 - 1.0);
    gl_Position = world_to_clip * vec4(world.x, 0.0, world.y, 1.0);
}
"""
)

UNEVEN_SHADE_VERTEX = (
    UNEVEN_GROUND
    + """
uniform vec3 area;
out vec2 uv;
void main() {
    uv = (corner.xz - area.xy) / (2.0 * area.z) + 0.5;
    gl_Position = world_to_clip * vec4(corner.xyz, 1.0);
}
"""
)

SHADE_FRAGMENT = (
    VERSION
    + """
uniform sampler2D shadow;
in vec2 uv;
out vec4 pixel;
void main() { pixel = vec4(texture(shadow, uv).r); }  // blended: what it takes from the ground
"""
)

# ---- marks: discs and arrows lying on the ground ------------------------------------------------------------

FLAT_MARK_VERTEX = (
    VERSION
    + """
layout(location = 0) in vec4 place;   // x, z of the start, x, z from there to the tip (for a disc: its radius along x)
layout(location = 1) in vec4 colour;
layout(location = 2) in vec2 kind;    // 0 soft disc, 1 ring, 2 arrow; half width in metres
uniform mat4 world_to_clip;
out vec2 at;          // metres from the start, along and across
flat out vec4 tint;
flat out vec3 look;   // kind, length, half width
void main() {
    float reach = length(place.zw);
    vec2 along = place.zw / max(reach, 1e-4), across = vec2(-along.y, along.x);
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    bool disc = kind.x < 1.5;
    vec2 arrow_corner = vec2(mix(-0.05, reach + 0.05, corner.x), (corner.y * 2.0 - 1.0) * (kind.y + 0.05));
    at = disc ? (corner * 2.0 - 1.0) * reach : arrow_corner;
    vec2 ground = place.xy + along * at.x + across * at.y;
    tint = colour;
    look = vec3(kind.x, reach, kind.y);
    gl_Position = world_to_clip * vec4(ground.x, 0.0, ground.y, 1.0);
}
"""
)

# One mark a draw, on the cells of the ground that it reaches into.
UNEVEN_MARK_VERTEX = (
    UNEVEN_GROUND
    + """
uniform vec4 place;
uniform vec4 colour;
uniform vec2 kind;
out vec2 at;
flat out vec4 tint;
flat out vec3 look;
void main() {
    float reach = length(place.zw);
    vec2 along = place.zw / max(reach, 1e-4), across = vec2(-along.y, along.x), from_start = corner.xz - place.xy;
    at = vec2(dot(from_start, along), dot(from_start, across));
    tint = colour;
    look = vec3(kind.x, reach, kind.y);
    gl_Position = world_to_clip * vec4(corner.xyz, 1.0);
}
"""
)

MARK_FRAGMENT = (
    VERSION
    + """
in vec2 at;
flat in vec4 tint;
flat in vec3 look;
out vec4 pixel;

// Signed distance to a shaft that grows into a head: negative inside.
float arrow(vec2 p, float reach, float half_width) {
    float head = min(half_width * 2.2, reach);
    float left = reach - p.x;                       // to the tip
    float shaft = max(abs(p.y) - 0.36 * half_width, max(-p.x, head - left - 1e-3));
    float tip = max(abs(p.y) * 0.91 - left * 0.415, left - head);
    return min(shaft, tip);
}

void main() {
    float alpha;
    if (look.x < 0.5) {
        float r = length(at) / look.y;
        alpha = max(1.0 - r, 0.0);
        alpha *= alpha;
    } else {
        float d = look.x < 1.5 ? abs(length(at) - (look.y - look.z)) - 0.5 * look.z : arrow(at, look.y, look.z);
        alpha = clamp(0.5 - d / fwidth(d), 0.0, 1.0);
    }
    pixel = vec4(tint.rgb, tint.a * alpha);
}
"""
)

# ---- lines: as wide on the screen wherever they are ---------------------------------------------------------

LINE_VERTEX = (
    VERSION
    + """
layout(location = 0) in vec4 start;   // metres; half width in pixels
layout(location = 1) in vec4 stop;    // metres; unused
layout(location = 2) in vec4 colour;
uniform mat4 world_to_clip;
uniform vec2 half_size;               // half the picture, in pixels
out vec2 at;                          // pixels from the start, along and across
flat out vec2 look;                   // length and half width in pixels
flat out vec4 tint;
void main() {
    vec4 a = world_to_clip * vec4(start.xyz, 1.0), b = world_to_clip * vec4(stop.xyz, 1.0);
    tint = colour;
    if (min(a.w, b.w) < 0.05) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }  // behind the eye
    vec2 p = a.xy / a.w * half_size, q = b.xy / b.w * half_size;
    float reach = length(q - p), margin = start.w + 1.0;
    vec2 along = reach > 1e-3 ? (q - p) / reach : vec2(1.0, 0.0), across = vec2(-along.y, along.x);
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    at = vec2(mix(-margin, reach + margin, corner.x), (corner.y * 2.0 - 1.0) * margin);
    look = vec2(reach, start.w);
    gl_Position = vec4((p + along * at.x + across * at.y) / half_size, 0.0, 1.0);
}
"""
)

LINE_FRAGMENT = (
    VERSION
    + """
in vec2 at;
flat in vec2 look;
flat in vec4 tint;
out vec4 pixel;
void main() {
    float away = length(vec2(at.x - clamp(at.x, 0.0, look.x), at.y));
    pixel = vec4(tint.rgb, tint.a * clamp(look.y + 0.5 - away, 0.0, 1.0));
}
"""
)

# ---- panels: pictures laid over the scene -------------------------------------------------------------------

PANEL_VERTEX = (
    VERSION
    + """
uniform vec4 box;  // left, bottom, width, height in clip units
out vec2 uv;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    uv = vec2(corner.x, 1.0 - corner.y);
    gl_Position = vec4(box.xy + corner * box.zw, 0.0, 1.0);
}
"""
)

PANEL_FRAGMENT = (
    VERSION
    + """
uniform sampler2D picture;
in vec2 uv;
out vec4 pixel;
void main() { pixel = texture(picture, uv); }
"""
)
