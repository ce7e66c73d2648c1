// What lies on the ground, and lines in the air: rows of numbers for the passes that draw them. See
// demo/render/ground_decals.py.

const DISC = 0, RING = 1, ARROW = 2;

// Shades and rings under the feet, and the arrow of the asked velocity; heights: of the ground, null for level floor.
export function marksOf(world, heights, poses, frame, seen) {
  const table = world.decals, rows = [];
  for (const { positions } of poses) {
    rows.push([positions[0][0], positions[0][2], 0.55, 0, ...table.SHADE, 0.16, DISC, 0]);
    for (const joint of table.SHADE_JOINTS) {
      const [x, y, z] = positions[joint], floor = heights ? heights.at(x, z) : 0;
      const near = Math.min(Math.max(1 - (y - floor - 0.02) / 0.25, 0), 1);
      if (near) rows.push([x, z, 0.15, 0, ...table.SHADE, 0.5 * near * near, DISC, 0]);
    }
  }
  if (seen.contacts)
    table.CONTACT_JOINTS.forEach((joint, i) => {
      const [x, , z] = poses[0].positions[joint], contact = frame.contacts[i] / 255;
      if (contact > 0.05) rows.push([x, z, table.RING_RADII[i], 0, ...table.CONTACT, 0.85 * contact, RING, 0.012]);
    });
  const way = frame.desired_velocity.map((speed) => speed * table.ARROW_SECONDS), reach = Math.hypot(...way);
  if (reach >= 0.05 && !frame.paths) {
    const start = [frame.root[0] + (way[0] / reach) * 0.42, frame.root[2] + (way[1] / reach) * 0.42];
    rows.push([...start, ...way, ...table.WISH, 0.85, ARROW, 0.085]);
  }
  return rows;
}

// The skeleton, and the ways that are asked for and predicted; unit: pixels of one.
export function linesOf(world, heights, unit, poses, frame, seen) {
  const rows = [];
  const line = (a, b, colour, alpha, half) => rows.push([...a, half * unit, ...b, 0, ...colour, alpha]);
  if (seen.skeleton)
    for (const { positions } of poses) {
      const bones = world.colours.scene.bones;
      positions.forEach((at, joint) => joint && line(positions[world.parents[joint]], at, bones, 0.85, 1.3));
      positions.forEach((at) => line(at, at, bones, 1, 3.2));
    }
  for (const [age, { positions }] of seen.past.entries())
    positions.forEach((at, joint) => joint && line(positions[world.parents[joint]], at, world.decals.LAST, 0.7 / (1 + 0.6 * age), 2));
  if (frame.paths) {
    const { PREDICTED, WISH } = world.decals, floor = (x, z) => (heights ? heights.at(x, z) : 0) + 0.012;
    const place = (x, z) => [x, floor(x, z), z];
    for (const [points, colour, half] of [[frame.paths.predicted, PREDICTED, 2.2], [frame.paths.desired, WISH, 1.4]]) {
      let last = place(frame.root[0], frame.root[2]);
      for (let i = 0; i < points.length; i += 2) {
        const at = place(points[i], points[i + 1]);
        line(last, at, colour, 0.9, half);
        line(at, at, colour, 1, 4);
        last = at;
      }
    }
  }
  return rows;
}
