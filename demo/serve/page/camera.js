// The camera of the window: it follows the character, orbits and zooms, each change eased. See demo/render/camera.py.

import { add, cross, dot, scale, subtract } from "./poses.js";

const TALL = 2.0, FILLED = 0.9; // metres that are seen whole, and the share of the room that they fill
const ROOM_HALF_LIFE = 0.1; // seconds of the way into another room
const LEAP = 1.0; // metres that no character goes in a picture: it was put somewhere else
const SIGHT = [0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1];
const clamp = (value, [low, high]) => Math.min(Math.max(value, low), high);

export class Camera {
  constructor(table) {
    this.table = table;
    this.wanted = { yaw: table.yaw, pitch: table.pitch, distance: table.distance };
    Object.assign(this, this.wanted);
    this.target = [...table.AIM];
    this.place = null; // of the character, when it was followed last
    this.velocity = [0, 0, 0]; // its, smoothed
    this.room = [0, 0, 1]; // where the target is in the picture, in clip units, and how many times farther off the eye
    this.shown = null; // the same, eased
  }

  orbit(yaw, pitch) {
    this.wanted.yaw += yaw;
    this.wanted.pitch = clamp(this.wanted.pitch + pitch, this.table.PITCH_LIMITS);
  }

  zoom(notches) {
    this.wanted.distance = clamp(this.wanted.distance * 0.9 ** notches, this.table.DISTANCE_LIMITS);
  }

  // The character belongs into the part of a picture that panels leave free, whole; in pixels.
  makeRoom(left, top, right, bottom, width, height) {
    const focal = Math.min(width, height) / (2 * Math.tan(this.table.field_of_view / 2));
    const needed = (TALL * focal) / (FILLED * (bottom - top)) / this.table.distance;
    this.room = [(left + right) / width - 1, 1 - (top + bottom) / height, Math.max(1, needed)];
    this.shown ??= [...this.room];
  }

  // Lets seconds pass while the character stands at a place; heights: of the ground, null for level floor.
  follow(place, seconds, heights) {
    const leapt = !this.place || Math.hypot(...subtract(place, this.place)) > LEAP;
    const speed = leapt ? [0, 0, 0] : subtract(place, this.place).map((way) => way / Math.max(seconds, 1e-3));
    const followed = leapt ? 1 : ease(seconds, this.table.LEAD_HALF_LIFE);
    this.velocity = this.velocity.map((old, axis) => old + (speed[axis] - old) * followed);
    this.place = place;
    const ahead = this.velocity.map((rate, axis) => rate * this.table.LEAD[axis]);
    const goal = add(add(place, this.table.AIM), ahead), way = subtract(goal, this.target);
    const halves = Math.hypot(way[0], way[2]) > LEAP * 2 ? [0, 0, 0] : this.table.FOLLOW_HALF_LIFE;
    this.target = this.target.map((at, axis) => at + way[axis] * ease(seconds, halves[axis]));
    const share = ease(seconds, this.table.ORBIT_HALF_LIFE);
    for (const name in this.wanted) this[name] += (this.wanted[name] - this[name]) * share;
    this.shown = this.shown.map((value, i) => value + (this.room[i] - value) * ease(seconds, ROOM_HALF_LIFE));
    if (heights) this.riseOver(heights);
  }

  riseOver(heights) {
    const { ANKLES, CLEARANCE, PITCH_LIMITS } = this.table, eye = this.eye;
    const least = Math.max(...SIGHT.map((share) => {
      const at = add(this.target, scale(subtract(eye, this.target), share));
      return (heights.at(at[0], at[2]) - (this.target[1] - ANKLES)) / share;
    })) - ANKLES + CLEARANCE;
    this.pitch = Math.max(this.pitch, Math.asin(clamp(least / this.away, [-1, Math.sin(PITCH_LIMITS[1])])));
  }

  get away() {
    return this.distance * this.shown[2];
  }

  get forward() {
    const level = Math.cos(this.pitch);
    return [Math.sin(this.yaw) * level, -Math.sin(this.pitch), Math.cos(this.yaw) * level];
  }

  get right() {
    return [-Math.cos(this.yaw), 0, Math.sin(this.yaw)];
  }

  get eye() {
    return subtract(this.target, scale(this.forward, this.away));
  }

  // Row by row, for column vectors; a picture higher than wide keeps the horizontal field of view instead.
  worldToClip(aspect) {
    const { NEAR, FAR, field_of_view } = this.table;
    const forward = this.forward, right = this.right, up = cross(right, forward), eye = this.eye;
    const focal = Math.min(1, aspect) / Math.tan(field_of_view / 2);
    const row = (axis) => [...axis, -dot(axis, eye)];
    const [x, y, depth] = [row(right), row(up), row(forward)];
    return [
      ...x.map((value, i) => (value * focal) / aspect + depth[i] * this.shown[0]),
      ...y.map((value, i) => value * focal + depth[i] * this.shown[1]),
      ...depth.map((value, i) => (value * (FAR + NEAR)) / (FAR - NEAR) - (i === 3 ? (2 * FAR * NEAR) / (FAR - NEAR) : 0)),
      ...depth,
    ];
  }

  // Where the ground ends in clip units, and the sine of the elevation in the middle with its growth upwards.
  sky(aspect, seen = 60) {
    const half = Math.atan(Math.tan(this.table.field_of_view / 2) / Math.min(1, aspect));
    const below = this.pitch - Math.atan2(this.eye[1], seen), middle = Math.sin(-this.pitch);
    const growth = Math.sin(half - this.pitch) - middle, up = this.shown[1];
    return { horizon: Math.tan(below) / Math.tan(half) + up, slope: [middle - growth * up, growth] };
  }

  // How many metres a pixel is, a metre from the eye.
  pixel(width, height) {
    return (2 * Math.tan(this.table.field_of_view / 2)) / Math.min(width, height);
  }
}

function ease(seconds, halfLife) {
  return halfLife ? 1 - 0.5 ** (seconds / halfLife) : 1;
}
