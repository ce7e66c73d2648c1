"""The shaders, GLSL 3.30. Where light is added up, colours are squared first and the root of the sum is shown."""

VERSION = "#version 330 core\n"

# ---- body: a skin that follows the joints -------------------------------------------------------------------

_SKIN = VERSION + """
layout(location = 0) in vec3 place;               // in the bind pose
layout(location = 1) in vec3 direction;
layout(location = 2) in vec4 joints;
layout(location = 3) in vec4 weights;
uniform vec4 bones[63];                           // of each of the 21 joints, bind pose to world: 3 x 4 by rows

vec4 row(int r) {
    ivec4 at = ivec4(joints) * 3 + r;
    return bones[at.x] * weights.x + bones[at.y] * weights.y + bones[at.z] * weights.z + bones[at.w] * weights.w;
}
"""

BODY_VERTEX = _SKIN + """
layout(location = 4) in float openness;
uniform vec4 tints[21];                           // display colour of each joint's skin
uniform mat4 world_to_clip;
uniform float pixel;                              // a pixel's width one metre from the eye
uniform float edges;                              // 0: the inside, opaque; 1: the rim, blended by how much is covered
out vec3 world;
out vec3 normal;
out vec3 colour;                                  // linear, with the light that the body itself keeps away
out vec3 bind;

void main() {
    vec4 x = row(0), y = row(1), z = row(2), p = vec4(place, 1.0);
    world = vec3(dot(x, p), dot(y, p), dot(z, p));
    normal = vec3(dot(x.xyz, direction), dot(y.xyz, direction), dot(z.xyz, direction));
    ivec4 at = ivec4(joints);
    vec4 share = weights * weights;               // sharper than the skin's own passage from joint to joint
    share *= share;
    share /= dot(share, vec4(1.0));
    vec4 tint = tints[at.x] * share.x + tints[at.y] * share.y + tints[at.z] * share.z + tints[at.w] * share.w;
    colour = tint.rgb * tint.rgb * mix(0.45, 1.0, openness);
    bind = place;
    gl_Position = world_to_clip * vec4(world, 1.0);
    // The inside is drawn half a pixel thinner and the rim half a pixel fatter: between them lies one pixel.
    float grow = (edges - 0.5) * pixel * gl_Position.w;
    gl_Position = world_to_clip * vec4(world + normal * grow, 1.0);
}
"""

BODY_FRAGMENT = VERSION + """
uniform vec3 eye;
uniform vec3 to_light;
uniform vec3 visor;   // the middle of the dark visor in the bind pose
uniform float edges;
in vec3 world;
in vec3 normal;
in vec3 colour;
in vec3 bind;
out vec4 pixel;

void main() {
    vec3 n = normalize(normal), v = normalize(eye - world);
    float facing = dot(n, v);
    float covered = 1.0;
    if (edges > 0.5) {
        if (facing > 0.6) discard;  // far from any outline
        // Near the outline of something round, `facing` grows as the root of the distance: its slope tells half of it.
        float slope = length(vec2(dFdx(facing), dFdy(facing)));
        covered = clamp(0.5 * facing / max(slope, 1e-4), 0.0, 1.0);
    }

    vec3 off = (bind - visor) * vec3(15.0, 34.0, 15.0);
    float glass = clamp((1.0 - dot(off, off)) * 9.0, 0.0, 1.0);
    vec3 base = mix(colour, vec3(0.006, 0.008, 0.013), glass);

    float lambert = dot(n, to_light);
    float key = max(0.80 * lambert + 0.20, 0.0);
    vec3 ambient = mix(vec3(0.20, 0.185, 0.18), vec3(0.34, 0.42, 0.52), 0.5 + 0.5 * n.y);
    vec3 light = vec3(1.045, 0.95, 0.82) * key + ambient;
    light *= 0.74 + 0.26 * clamp(world.y * 1.3 + 0.1, 0.0, 1.0);    // close to the ground less light comes in
    float rim = 1.0 - max(facing, 0.0);
    rim *= rim;
    float gleam = max(dot(n, normalize(v + to_light)), 0.0);
    gleam *= gleam; gleam *= gleam; gleam *= gleam; gleam *= gleam;
    vec3 lit = base * light + rim * rim * vec3(0.15, 0.19, 0.24) + (0.11 + 0.6 * glass) * gleam * max(lambert, 0.0);
    pixel = vec4(sqrt(lit), covered);
}
"""

# ---- shadow: the body flattened along the light into a small picture of the ground --------------------------

SHADOW_VERTEX = _SKIN + """
uniform vec3 to_light;
uniform vec3 area;  // centre x, z and half width of the ground in the picture
out float height;

void main() {
    vec4 at = vec4(place, 1.0);
    vec3 p = vec3(dot(row(0), at), dot(row(1), at), dot(row(2), at));
    height = p.y;
    vec2 ground = p.xz - to_light.xz * (p.y / to_light.y);
    gl_Position = vec4((ground - area.xy) / area.z, 0.0, 1.0);
}
"""

SHADOW_FRAGMENT = VERSION + """
in float height;
out vec4 pixel;
void main() { pixel = vec4(clamp(0.62 - 0.20 * height, 0.0, 1.0)); }  // what is high up casts a weaker shadow
"""

FULL_VERTEX = VERSION + """
out vec2 uv;
void main() {
    uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(uv * 2.0 - 1.0, 1.0, 1.0);
}
"""

BLUR_FRAGMENT = VERSION + """
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

# ---- ground and sky -----------------------------------------------------------------------------------------

SKY = """
const vec3 HORIZON = vec3(0.860, 0.890, 0.915);
const vec3 ZENITH = vec3(0.46, 0.60, 0.745);
"""

SKY_VERTEX = VERSION + """
uniform float horizon;  // where it is in the picture, in clip units: only what lies above is sky
uniform vec2 slope;     // sine of the elevation in the middle of the picture and its growth from there to the top
out float up;
void main() {
    float y = mix(max(horizon, -1.0), 1.0, float(gl_VertexID >> 1));
    up = (slope.x + slope.y * y) * 1.7;
    gl_Position = vec4(float(gl_VertexID & 1) * 2.0 - 1.0, y, 1.0, 1.0);
}
"""

SKY_FRAGMENT = VERSION + SKY + """
in float up;
out vec4 pixel;
void main() {
    float high = clamp(up, 0.0, 1.0);
    pixel = vec4(mix(HORIZON, ZENITH, high * (2.0 - high)), 1.0);
}
"""

GROUND_VERTEX = VERSION + """
uniform mat4 world_to_clip;
uniform vec3 focus;  // under the camera's target
const float GROUND_REACH = 100.0;  // metres: the haze has long closed over it
out vec2 world;
out vec2 from_focus;
void main() {
    from_focus = GROUND_REACH * (2.0 * vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) - 1.0);  // one large triangle
    world = focus.xz + from_focus;
    gl_Position = world_to_clip * vec4(world.x, 0.0, world.y, 1.0);
}
"""

GROUND_FRAGMENT = VERSION + SKY + """
in vec2 world;
in vec2 from_focus;
out vec4 pixel;

// How much of a pixel lies on lines `width` wide at every whole number, with `density` pixels to 1: where lines crowd,
// their mean.
float lines(vec2 p, vec2 density, float width) {
    vec2 away = abs(fract(p - 0.5) - 0.5);
    vec2 covered = clamp((width - away) * density + 0.5, 0.0, 1.0) * min(width * 2.0 * density, 1.0);
    return max(covered.x, covered.y);
}

void main() {
    float distance = dot(from_focus, from_focus);
    vec2 density = 1.0 / fwidth(world);
    float marks = 0.055 * lines(world, density, 0.010) + 0.080 * lines(world * 0.2, density * 5.0, 0.0035);
    vec3 ground = mix(vec3(0.735, 0.765, 0.790), vec3(0.815, 0.832, 0.845), 1.0 / (1.0 + distance * 0.06));
    pixel = vec4(mix(HORIZON, ground - marks, 1.0 / (1.0 + distance * distance * 6e-5)), 1.0);
}
"""

SHADE_VERTEX = VERSION + """
uniform mat4 world_to_clip;
uniform vec3 area;  // centre x, z and half width of the ground in the shadow's picture
out vec2 uv;
void main() {
    uv = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec2 world = area.xy + area.z * (uv * 2.0 - 1.0);
    gl_Position = world_to_clip * vec4(world.x, 0.0, world.y, 1.0);
}
"""

SHADE_FRAGMENT = VERSION + """
uniform sampler2D shadow;
in vec2 uv;
out vec4 pixel;
void main() { pixel = vec4(texture(shadow, uv).r); }  // blended: what it takes from the ground
"""

# ---- marks: discs and arrows lying on the ground ------------------------------------------------------------

MARK_VERTEX = VERSION + """
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

MARK_FRAGMENT = VERSION + """
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

# ---- panels: pictures laid over the scene -------------------------------------------------------------------

PANEL_VERTEX = VERSION + """
uniform vec4 box;  // left, bottom, width, height in clip units
out vec2 uv;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    uv = vec2(corner.x, 1.0 - corner.y);
    gl_Position = vec4(box.xy + corner * box.zw, 0.0, 1.0);
}
"""

PANEL_FRAGMENT = VERSION + """
uniform sampler2D picture;
in vec2 uv;
out vec4 pixel;
void main() { pixel = texture(picture, uv); }
"""
