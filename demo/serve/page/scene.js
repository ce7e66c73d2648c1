// The picture: the window's passes and shaders (demo/render) in WebGL 2, the mesh skinned by the visitor's own GPU.

import { linesOf, marksOf } from "./decals.js";
import { buffer, depthMap, picture, Program, Rows, target } from "./gl.js";
import { GroundMesh } from "./ground.js";
import { characterPose, cross, dot, scale, skinningMatrices } from "./poses.js";

const LIGHT_MAP_PIXELS = 512, SOFTNESS = 0.014, LIGHT_MAP_MARGIN = 0.25;
const SHADOW_PIXELS = 256, SHADOW_BLUR = 0.02, SHADOW_MARGIN = 0.3;
const COLOUR_EASE = 0.15; // share of a colour's change that one picture makes
const TWIN_DISTANCE = 1.15;
const ARROW_MARGIN = 0.05; // metres about an arrow within which it is drawn
const GROUND_COLOUR = [0.75, 0.77, 0.79];

// Linear blend skinning, once for all passes of the picture.
const SKINNING_VERTEX = `#version 300 es
in vec3 position;
in vec3 normal;
in vec4 joints;
in vec4 weights;
uniform mat3x4 bones[BONES]; // the rows of a matrix
out vec3 place;
out vec3 direction;
void main() {
    mat3x4 bone = bones[int(joints.x)] * weights.x + bones[int(joints.y)] * weights.y
                + bones[int(joints.z)] * weights.z + bones[int(joints.w)] * weights.w;
    place = vec4(position, 1.0) * bone;
    direction = vec4(normal, 0.0) * bone;
}`;
const NOTHING = "#version 300 es\nprecision highp float;\nvoid main() {}";

export class Scene {
  constructor(canvas, world, figure, skeleton) {
    const gl = makeContext(canvas);
    if (!gl) throw new Error("this browser has no WebGL 2: turn hardware acceleration on, or use a newer one");
    const of = world.shaders, program = (vertex, fragment) => new Program(gl, of[vertex], of[fragment]);
    Object.assign(this, { gl, canvas, world, skeleton });
    this.skinning = new Program(gl, SKINNING_VERTEX.replace("BONES", world.bones.most), NOTHING, ["place", "direction"]);
    this.body = program("BODY_VERTEX", "FIGURE_FRAGMENT");
    this.painted = program("BODY_VERTEX", "PAINTED_FRAGMENT");
    this.deep = program("DEPTH_VERTEX", "DEPTH_FRAGMENT");
    this.ghost = program("BODY_VERTEX", "GHOST_FRAGMENT");
    this.cast = program("SHADOW_VERTEX", "SHADOW_FRAGMENT");
    this.blur = program("FULL_VERTEX", "BLUR_FRAGMENT");
    this.sky = program("SKY_VERTEX", "SKY_FRAGMENT");
    this.flat = {
      ground: program("FLAT_GROUND_VERTEX", "GROUND_FRAGMENT"),
      shade: program("FLAT_SHADE_VERTEX", "SHADE_FRAGMENT"),
    };
    this.uneven = {
      ground: program("UNEVEN_GROUND_VERTEX", "GROUND_FRAGMENT"),
      shade: program("UNEVEN_SHADE_VERTEX", "SHADE_FRAGMENT"),
      mark: program("UNEVEN_MARK_VERTEX", "MARK_FRAGMENT"),
    };
    this.marks = new Rows(gl, program("FLAT_MARK_VERTEX", "MARK_FRAGMENT"), [["place", 4], ["colour", 4], ["kind", 2]]);
    this.lines = new Rows(gl, program("LINE_VERTEX", "LINE_FRAGMENT"), [["start", 4], ["stop", 4], ["colour", 4]]);
    this.shadows = [target(gl, SHADOW_PIXELS), target(gl, SHADOW_PIXELS)];
    this.lightMap = depthMap(gl, LIGHT_MAP_PIXELS);
    this.figure = this.makeFigure(figure);
    this.twin = this.makeFigure(figure);
    this.character = null; // the user's own, drawn in place of the figure
    this.tints = null;
    this.ground = null;
    this.fence = null; // behind all that the last picture asks of the card
    gl.disable(gl.DITHER);
  }

  // Whether the card still draws the last picture.
  get isBusy() {
    return this.fence !== null && this.gl.getSyncParameter(this.fence, this.gl.SYNC_STATUS) !== this.gl.SIGNALED;
  }

  // What one figure needs on the card: its skins with buffers for where their corners are, and its picture.
  makeFigure(model) {
    const gl = this.gl, result = { bind: model.bind.bones, picture: model.image ? picture(gl, model.image) : null };
    for (const level of ["fine", "coarse"]) {
      const skin = model[level], count = skin.position.length / 3, own = {};
      for (const name of ["position", "normal"]) own[name] = { buffer: buffer(gl, skin[name]), width: 3 };
      for (const name of ["joints", "weights"]) own[name] = { buffer: buffer(gl, skin[name]), width: 4 };
      const posed = { triangles: buffer(gl, skin.triangles, gl.ELEMENT_ARRAY_BUFFER), bind_place: own.position };
      for (const name of ["place", "direction"]) {
        posed[name] = { buffer: gl.createBuffer(), width: 3 };
        gl.bindBuffer(gl.ARRAY_BUFFER, posed[name].buffer);
        gl.bufferData(gl.ARRAY_BUFFER, 12 * count, gl.DYNAMIC_COPY);
      }
      const material = buffer(gl, skin.material);
      posed.first = { buffer: material, width: 4, stride: 24 };
      posed.second = { buffer: material, width: 2, stride: 24, offset: 16 };
      result[level] = { own, posed, count, feedback: gl.createTransformFeedback(), length: skin.triangles.length };
    }
    return result;
  }

  // Draws a model from now on in those frames that carry its bones.
  setCharacter(model) {
    this.character = this.makeFigure(model);
  }

  standOn(heights) {
    this.heights = heights;
    this.ground = heights ? new GroundMesh(this.gl, heights, this.world) : null;
  }

  // One picture of a frame; seen: what is shown besides, as the server's state has it.
  draw(frame, camera, seen) {
    const gl = this.gl, { width, height } = this.canvas, aspect = width / height;
    const worldToClip = camera.worldToClip(aspect), right = camera.right;
    const shift = seen.twin === "beside" ? this.twinShift(frame, scale(right, -TWIN_DISTANCE)) : [0, 0, 0];
    const poses = [this.skeleton.pose(frame)], character = frame.bones && this.character, figures = [character || this.figure];
    this.pose(figures[0], character ? characterPose(frame, this.world.bones.place) : poses[0]);
    if (frame.twin) poses.push(this.skeleton.pose(frame.twin, shift));
    if (frame.twin) this.pose(this.twin, poses[1]);
    if (seen.twin === "beside") figures.push(this.twin);
    this.easeColours(frame.colours, seen.glow);

    const solid = poses.slice(0, figures.length), area = this.shadowArea(solid, frame.plane);
    this.castShadow(figures, frame.plane, area);
    const lit = this.castLight(figures, solid);

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, width, height);
    gl.depthMask(true);
    gl.clearColor(...GROUND_COLOUR, 1);
    gl.clear(gl.DEPTH_BUFFER_BIT | gl.COLOR_BUFFER_BIT);
    const eye = camera.eye, values = {
      world_to_clip: worldToClip, focus: camera.target, area, shadow: 0, eye, to_light: this.world.light,
      visor: this.world.visor, plane: frame.plane, ...lit,
      half_size: [width / 2, height / 2], ...camera.sky(aspect),
    };
    const marks = marksOf(this.world, this.heights, solid, frame, seen);
    (this.ground ? this.drawUneven : this.drawFlat).call(this, values, marks);
    this.drawBodies(values, figures);
    if (seen.twin === "ghost" && frame.twin) this.drawGhost(values);
    seen.past = (seen.past ?? []).map((each) => this.skeleton.pose(each));
    this.lines.draw(linesOf(this.world, this.heights, height / 720, solid, frame, seen), values);
    gl.bindVertexArray(null);
    gl.deleteSync(this.fence);
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    return { poses, worldToClip };
  }

  twinShift(frame, shift) {
    const [, riseX, riseZ] = frame.plane;
    return [shift[0], this.heights ? riseX * shift[0] + riseZ * shift[2] : 0, shift[2]];
  }

  pose(figure, pose) {
    const gl = this.gl, bones = skinningMatrices(pose, figure.bind);
    gl.enable(gl.RASTERIZER_DISCARD);
    for (const level of ["fine", "coarse"]) {
      const { own, posed, count, feedback } = figure[level];
      this.skinning.use({ bones }).bind(own);
      gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, feedback);
      gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, posed.place.buffer);
      gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 1, posed.direction.buffer);
      gl.beginTransformFeedback(gl.POINTS);
      gl.drawArrays(gl.POINTS, 0, count);
      gl.endTransformFeedback();
      for (const place of [0, 1]) gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, place, null);
      gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
    }
    gl.disable(gl.RASTERIZER_DISCARD);
  }

  easeColours(colours, glow) {
    const wanted = colours.map((channel) => channel / 255);
    this.tints ??= wanted;
    this.tints = this.tints.map((channel, i) => channel + COLOUR_EASE * (wanted[i] - channel));
    const lit = (channel, part) => channel + 0.7 * (glow?.[this.world.parts[part]] ?? 0) * (1 - channel);
    this.shownTints = new Float32Array(20).fill(1);
    this.tints.forEach((channel, i) => {
      const part = Math.floor(i / 3);
      this.shownTints[4 * part + (i % 3)] = lit(channel, part);
    });
  }

  // ---- shadow ------------------------------------------------------------------------------

  shadowArea(poses, plane) {
    const light = this.world.light, steep = light[1] - plane[1] * light[0] - plane[2] * light[2];
    let low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (const { positions } of poses)
      for (const [x, y, z] of positions) {
        const height = (y - plane[0] - plane[1] * x - plane[2] * z) / steep;
        const at = [x - light[0] * height, z - light[2] * height];
        low = low.map((value, i) => Math.min(value, at[i]));
        high = high.map((value, i) => Math.max(value, at[i]));
      }
    const half = Math.max(high[0] - low[0], high[1] - low[1]) / 2 + SHADOW_MARGIN;
    return [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, half];
  }

  castShadow(figures, plane, area) {
    const gl = this.gl, [sharp, blurred] = this.shadows, values = { plane, area, to_light: this.world.light };
    gl.viewport(0, 0, sharp.side, sharp.side);
    gl.bindFramebuffer(gl.FRAMEBUFFER, sharp.frame);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT);
    gl.enable(gl.BLEND);
    gl.blendEquation(gl.MAX);
    for (const { coarse } of figures) {
      this.cast.use(values).bind(coarse.posed);
      gl.drawElements(gl.TRIANGLES, coarse.length, gl.UNSIGNED_INT, 0);
    }
    gl.blendEquation(gl.FUNC_ADD);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
    const step = SHADOW_BLUR / (2 * area[2]);
    for (const [from, to, texel] of [[sharp, blurred, [step, 0]], [blurred, sharp, [0, step]]]) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, to.frame);
      gl.bindTexture(gl.TEXTURE_2D, from.texture);
      this.blur.use({ picture: 0, texel });
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
    gl.bindTexture(gl.TEXTURE_2D, sharp.texture);
  }

  // Draws the depth of what the light sees of the figures; where that is, and how soft its edges are.
  castLight(figures, poses) {
    const gl = this.gl, light = this.world.light, across = cross([0, 1, 0], light);
    const right = scale(across, 1 / Math.hypot(...across)), axes = [right, cross(light, right), scale(light, -1)];
    const rows = axes.map((axis) => {
      const along = poses.flatMap(({ positions }) => positions.map((at) => dot(axis, at)));
      return [Math.min(...along) - LIGHT_MAP_MARGIN, Math.max(...along) + LIGHT_MAP_MARGIN];
    });
    const side = Math.max(rows[0][1] - rows[0][0], rows[1][1] - rows[1][0]), sides = [side, side, rows[2][1] - rows[2][0]];
    const world_to_light = axes.flatMap((axis, i) => [
      ...scale(axis, 1 / sides[i]), 0.5 - (rows[i][0] + rows[i][1]) / 2 / sides[i],
    ]).concat([0, 0, 0, 1]);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.lightMap.frame);
    gl.viewport(0, 0, this.lightMap.side, this.lightMap.side);
    gl.depthMask(true);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    this.setSolid(true);
    gl.cullFace(gl.FRONT);
    for (const { coarse } of figures) {
      this.deep.use({ world_to_light }).bind(coarse.posed);
      gl.drawElements(gl.TRIANGLES, coarse.length, gl.UNSIGNED_INT, 0);
    }
    gl.cullFace(gl.BACK);
    this.setSolid(false);
    return { world_to_light, light_map: 1, picture: 2, softness: [SOFTNESS / side, SOFTNESS / side] };
  }

  // ---- ground ------------------------------------------------------------------------------

  drawSky(values) {
    const gl = this.gl;
    if (values.horizon >= 1) return;
    gl.bindVertexArray(null);
    this.sky.use(values);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
  }

  drawFlat(values, marks) {
    const gl = this.gl;
    gl.disable(gl.BLEND);
    this.drawSky(values);
    this.flat.ground.use(values);
    gl.bindVertexArray(null);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    this.beginShade();
    this.flat.shade.use(values);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    this.marks.draw(marks, values);
  }

  drawUneven(values, marks) {
    const gl = this.gl;
    this.ground.move(values.focus[0], values.focus[2]);
    gl.disable(gl.BLEND);
    this.drawSky({ ...values, horizon: -1 });
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.ground.draw(this.uneven.ground.use(values));
    this.beginShade();
    const { shade, mark } = this.uneven, [, middle, half] = values.area;
    this.ground.drawRows(shade.use(values), middle - half, middle + half);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    for (const row of marks) {
      const reach = Math.hypot(row[2], row[3]) + row[9] + ARROW_MARGIN;
      mark.use({ ...values, place: row.slice(0, 4), colour: row.slice(4, 8), kind: row.slice(8) });
      this.ground.drawRows(mark, row[1] - reach, row[1] + reach);
    }
    gl.depthFunc(gl.LESS);
    gl.disable(gl.DEPTH_TEST);
  }

  beginShade() {
    this.gl.enable(this.gl.BLEND);
    this.gl.blendFunc(this.gl.ZERO, this.gl.ONE_MINUS_SRC_COLOR);
  }

  // ---- bodies ------------------------------------------------------------------------------

  drawBodies(values, figures) {
    const gl = this.gl;
    gl.disable(gl.BLEND);
    this.setSolid(true);
    this.bindTexture(1, this.lightMap.texture);
    const twin = tintsOf(this.world.colours.scene.twin);
    for (const figure of figures) {
      if (figure.picture) this.bindTexture(2, figure.picture);
      const tints = figure === this.twin ? twin : this.shownTints, { fine } = figure;
      (figure.picture ? this.painted : this.body).use({ ...values, tints }).bind(fine.posed);
      gl.drawElements(gl.TRIANGLES, fine.length, gl.UNSIGNED_INT, 0);
    }
    gl.activeTexture(gl.TEXTURE0);
    this.setSolid(false);
  }

  bindTexture(unit, texture) {
    this.gl.activeTexture(this.gl.TEXTURE0 + unit);
    this.gl.bindTexture(this.gl.TEXTURE_2D, texture);
  }

  drawGhost(values) {
    const gl = this.gl, tints = tintsOf(this.world.colours.scene.ghost), { fine } = this.twin;
    this.setSolid(true);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    this.ghost.use({ ...values, tints, opacity: 0.85 }).bind(fine.posed);
    gl.drawElements(gl.TRIANGLES, fine.length, gl.UNSIGNED_INT, 0);
    gl.depthMask(true);
    this.setSolid(false);
  }

  // Depth test and back faces: on for what is solid.
  setSolid(on) {
    for (const what of [this.gl.DEPTH_TEST, this.gl.CULL_FACE]) on ? this.gl.enable(what) : this.gl.disable(what);
  }
}

// Smooth outlines only where a graphics card draws: for a processor they cost more than all else of the picture. See
// demo/render/quality.py.
function makeContext(canvas) {
  const probe = document.createElement("canvas").getContext("webgl2");
  const renderer = probe?.getParameter(probe.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? probe.RENDERER);
  probe?.getExtension("WEBGL_lose_context")?.loseContext();
  const antialias = !/swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer);
  return canvas.getContext("webgl2", { antialias, alpha: false, powerPreference: "high-performance" });
}

// One opaque colour for all five parts.
function tintsOf(colour) {
  const tints = new Float32Array(20).fill(1);
  for (let part = 0; part < 5; part++) tints.set(colour, 4 * part);
  return tints;
}

// Pixels of places in a picture.
export function toPixels(positions, worldToClip, width, height) {
  return positions.map((at) => {
    const [x, y, , w] = [0, 1, 2, 3].map((row) => dot(worldToClip.slice(4 * row, 4 * row + 3), at) + worldToClip[4 * row + 3]);
    return [((x / w + 1) / 2) * width, ((1 - y / w) / 2) * height];
  });
}
