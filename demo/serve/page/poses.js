// Poses: read from packets, put together by forward kinematics, and turned into matrices that skin a mesh.

const KINDS = { f32: "getFloat32", i16: "getInt16", u16: "getUint16", u32: "getUint32", u8: "getUint8" };

// A packet as { number, root, hips, rotations ..., twin, paths }, by the places that the server told.
export function readPacket(bytes, layout) {
  const view = new DataView(bytes);
  let start = 0;
  const record = (name) => {
    const { size, fields } = layout.records[name], result = {};
    for (const field in fields) {
      const [offset, kind, count] = fields[field];
      const step = parseInt(kind.slice(1)) / 8, read = KINDS[kind];
      const values = [];
      for (let i = 0; i < count; i++) values.push(view[read](start + offset + i * step, true));
      result[field] = count === 1 ? values[0] : values;
    }
    start += size;
    return result;
  };
  const frame = record("frame");
  const has = (flag) => (frame.flags & layout.flags[flag]) !== 0;
  frame.playing = has("playing");
  frame.twin = has("twin") ? record("twin") : null;
  frame.paths = has("paths") ? record("paths") : null;
  frame.bones = has("character") ? new Int16Array(bytes.slice(start)) : null; // of the user's character, see characterPose
  return frame;
}

// Bones of a user's character, seven numbers each: rotations away from its rest pose, and places beside the root.
export function characterPose(frame, unit) {
  const rotations = [], positions = [];
  for (let at = 0; at < frame.bones.length; at += 7) {
    const q = Array.from(frame.bones.subarray(at, at + 4)), length = Math.hypot(...q);
    rotations.push(q.map((share) => share / length));
    positions.push(frame.root.map((value, axis) => value + frame.bones[at + 4 + axis] * unit));
  }
  return { positions, rotations };
}

// Three rows of a matrix for each bone: from the pose that the skin is made in, (bones, 7) places
// and rotations (w, x, y, z), to this one.
export function skinningMatrices({ positions, rotations }, bind) {
  const result = new Float32Array(12 * rotations.length);
  rotations.forEach((rotation, bone) => {
    const at = bind.subarray(7 * bone, 7 * bone + 7);
    const turn = multiply(rotation, [at[3], -at[4], -at[5], -at[6]]);
    const x = rotate(turn, [1, 0, 0]), y = rotate(turn, [0, 1, 0]), z = rotate(turn, [0, 0, 1]);
    const moved = rotate(turn, [at[0], at[1], at[2]]), place = positions[bone];
    for (let row = 0; row < 3; row++) result.set([x[row], y[row], z[row], place[row] - moved[row]], 12 * bone + 4 * row);
  });
  return result;
}

export class Skeleton {
  constructor(world) {
    this.parents = world.parents;
    this.offsets = world.offsets;
  }

  // A record's pose: positions and rotations of the joints, from where its hips are, moved by a shift.
  pose(record, shift = [0, 0, 0]) {
    const rotations = [], positions = [];
    for (let joint = 0; joint < this.parents.length; joint++) {
      const q = record.rotations.slice(4 * joint, 4 * joint + 4), length = Math.hypot(...q);
      rotations.push(q.map((share) => share / length));
      const parent = this.parents[joint];
      positions.push(parent < 0 ? add(record.hips, shift) : add(positions[parent], rotate(rotations[parent], this.offsets[joint])));
    }
    return { positions, rotations };
  }
}

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function rotate([w, x, y, z], v) {
  const t = scale(cross([x, y, z], v), 2);
  return add(add(v, scale(t, w)), cross([x, y, z], t));
}

function multiply([a, b, c, d], [e, f, g, h]) {
  return [
    a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g,
    a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e,
  ];
}
