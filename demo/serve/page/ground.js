// Uneven ground: heights, and square grids nested about the character, each coarser than the one inside it.

const LEVELS = [[0.05, 144], [0.1, 144], [0.4, 96]]; // metres of a cell, cells of a side
const STEPS = 8; // cells that a grid is moved at once
const SUNK = 0.01; // metres that a grid lies deeper for each that is finer: those hide it where they overlap
const BLURRED = 0.2; // metres: grids whose cells are larger are too coarse for steps, and are of blurred ground

export class Heights {
  constructor(bytes) {
    const view = new DataView(bytes);
    [this.rows, this.columns, this.tiled] = [0, 4, 8].map((at) => view.getUint32(at, true));
    this.cell = view.getFloat32(12, true);
    this.table = new Int16Array(bytes, 16);
  }

  // Metres at a place, between the places of the table in straight lines.
  at(x, z) {
    const column = x / this.cell + (this.columns >> 1), row = z / this.cell + (this.rows >> 1);
    const c = Math.floor(column), r = Math.floor(row), u = column - c, v = row - r;
    const near = this.get(r, c) * (1 - v) + this.get(r + 1, c) * v;
    const far = this.get(r, c + 1) * (1 - v) + this.get(r + 1, c + 1) * v;
    return 0.001 * (near * (1 - u) + far * u);
  }

  // The same, blurred: the mean of nine places a step apart.
  mean(x, z, step) {
    if (!step) return this.at(x, z);
    let sum = 0;
    for (const dx of [-step, 0, step]) for (const dz of [-step, 0, step]) sum += this.at(x + dx, z + dz);
    return sum / 9;
  }

  get(row, column) {
    const fit = (value, count) =>
      this.tiled ? ((value % count) + count) % count : Math.min(Math.max(value, 0), count - 1);
    return this.table[fit(row, this.rows) * this.columns + fit(column, this.columns)];
  }
}

export class GroundMesh {
  constructor(gl, heights, world) {
    this.gl = gl;
    this.heights = heights;
    this.light = world.light;
    this.shades = world.decals;
    this.grids = LEVELS.map(([cell, side], level) => this.makeGrid(cell, side, level));
  }

  makeGrid(cell, side, level) {
    const gl = this.gl, corners = gl.createBuffer(), width = side + 1;
    const finer = level ? (LEVELS[level - 1][0] * LEVELS[level - 1][1]) / 2 - STEPS * LEVELS[level - 1][0] - cell : 0;
    const hole = Math.floor(finer / cell) - STEPS / 2, triangles = [];
    for (let row = 0; row < side; row++)
      for (let column = 0; column < side; column++) {
        const inner = level && Math.max(Math.abs(row + 0.5 - side / 2), Math.abs(column + 0.5 - side / 2)) < hole;
        const a = row * width + column;
        if (!inner) triangles.push(a, a + width, a + width + 1, a, a + width + 1, a + 1);
      }
    const block = new Uint32Array(triangles), indices = gl.createBuffer();
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, block, gl.STATIC_DRAW);
    const mesh = { corner: { buffer: corners, width: 4 }, triangles: indices };
    return { cell, side, level, corners, mesh, count: block.length, middle: null };
  }

  // Moves the grids to a place; corners are ever at the same points of the ground, so that nothing swims.
  move(x, z) {
    for (const grid of this.grids) {
      const step = STEPS * grid.cell;
      const middle = [Math.round(x / step) * step, Math.round(z / step) * step];
      if (grid.middle && middle[0] === grid.middle[0] && middle[1] === grid.middle[1]) continue;
      grid.middle = middle;
      const width = grid.side + 1, values = new Float32Array(4 * width * width), heights = new Float32Array(width * width);
      const at = (i, axis) => middle[axis] + (i - grid.side / 2) * grid.cell;
      for (let row = 0; row < width; row++)
        for (let column = 0; column < width; column++)
          heights[row * width + column] = this.heights.mean(at(column, 0), at(row, 1), grid.cell > BLURRED ? grid.cell / 3 : 0);
      const get = (row, column) =>
        heights[Math.min(Math.max(row, 0), grid.side) * width + Math.min(Math.max(column, 0), grid.side)];
      for (let row = 0; row < width; row++)
        for (let column = 0; column < width; column++) {
          const rise = [get(row, column + 1) - get(row, column - 1), get(row + 1, column) - get(row - 1, column)];
          const light = this.lightOn(rise[0] / (2 * grid.cell), rise[1] / (2 * grid.cell));
          values.set([at(column, 0), get(row, column) - SUNK * grid.level, at(row, 1), light], 4 * (row * width + column));
        }
      this.gl.bindBuffer(this.gl.ARRAY_BUFFER, grid.corners);
      this.gl.bufferData(this.gl.ARRAY_BUFFER, values, this.gl.DYNAMIC_DRAW);
    }
  }

  lightOn(riseX, riseZ) {
    const { SKY_LIGHT, SUN_LIGHT, DARKEST } = this.shades, [x, y, z] = this.light;
    const upright = 1 / Math.hypot(1, riseX, riseZ), sun = upright * Math.max(y - riseX * x - riseZ * z, 0);
    const light = (SKY_LIGHT * (0.5 + 0.5 * upright) + SUN_LIGHT * sun) / (SKY_LIGHT + SUN_LIGHT * y);
    return Math.max(light, DARKEST);
  }

  // Draws all grids with a program in use.
  draw(program) {
    for (const grid of [...this.grids].reverse()) {
      program.bind(grid.mesh);
      this.gl.drawElements(this.gl.TRIANGLES, grid.count, this.gl.UNSIGNED_INT, 0);
    }
  }

  // Draws those rows of the finest grid that reach into a stretch of z.
  drawRows(program, low, high) {
    const { cell, side, middle, mesh } = this.grids[0];
    const row = (z) => Math.min(Math.max(Math.floor((z - middle[1]) / cell) + side / 2, 0), side);
    const first = row(low), count = Math.min(row(high) + 1, side) - first;
    if (count <= 0) return;
    program.bind(mesh);
    this.gl.drawElements(this.gl.TRIANGLES, 6 * side * count, this.gl.UNSIGNED_INT, 24 * side * first);
  }
}
