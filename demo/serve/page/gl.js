// Small helpers over WebGL 2: programs whose attributes and uniforms are set by name, buffers, targets.

export class Program {
  constructor(gl, vertex, fragment, captured = null) {
    this.gl = gl;
    this.handle = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(this.handle, shader);
    }
    if (captured) gl.transformFeedbackVaryings(this.handle, captured, gl.SEPARATE_ATTRIBS);
    gl.linkProgram(this.handle);
    if (!gl.getProgramParameter(this.handle, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(this.handle));
    this.attributes = named(gl, this.handle, gl.ACTIVE_ATTRIBUTES, "getActiveAttrib", "getAttribLocation");
    this.uniforms = named(gl, this.handle, gl.ACTIVE_UNIFORMS, "getActiveUniform", "getUniformLocation");
    this.arrays = new Map(); // mesh -> its vertex array, as this program reads it
  }

  // Makes it current and sets those of some values that it has: numbers, vectors, and 4 x 4 matrices row by row.
  use(values) {
    const gl = this.gl;
    gl.useProgram(this.handle);
    for (const name in values) {
      const uniform = this.uniforms[name], value = values[name];
      if (!uniform) continue;
      const { place, type } = uniform;
      if (type === gl.FLOAT) gl.uniform1f(place, value);
      else if (type === gl.FLOAT_VEC2) gl.uniform2fv(place, value);
      else if (type === gl.FLOAT_VEC3) gl.uniform3fv(place, value);
      else if (type === gl.FLOAT_VEC4) gl.uniform4fv(place, value);
      else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(place, true, value);
      else if (type === gl.FLOAT_MAT3x4) gl.uniformMatrix3x4fv(place, false, value);
      else gl.uniform1i(place, value); // a sampler's unit
    }
    return this;
  }

  // Binds a mesh: { attribute: { buffer, width, offset, stride, divisor } }, and `triangles` where it has any.
  bind(mesh) {
    const gl = this.gl;
    let array = this.arrays.get(mesh);
    if (!array) {
      array = gl.createVertexArray();
      gl.bindVertexArray(array);
      for (const name in this.attributes) {
        const field = mesh[name];
        if (!field) continue;
        gl.bindBuffer(gl.ARRAY_BUFFER, field.buffer);
        gl.enableVertexAttribArray(this.attributes[name].place);
        const { width, stride = 0, offset = 0, divisor = 0 } = field;
        gl.vertexAttribPointer(this.attributes[name].place, width, gl.FLOAT, false, stride, offset);
        gl.vertexAttribDivisor(this.attributes[name].place, divisor);
      }
      if (mesh.triangles) gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles);
      this.arrays.set(mesh, array);
    }
    gl.bindVertexArray(array);
    return this;
  }
}

function named(gl, handle, count, active, location) {
  const result = {};
  for (let i = 0; i < gl.getProgramParameter(handle, count); i++) {
    const { name, type } = gl[active](handle, i);
    const plain = name.replace("[0]", "");
    result[plain] = { type, place: gl[location](handle, plain) };
  }
  return result;
}

export function buffer(gl, values, target = gl.ARRAY_BUFFER) {
  const handle = gl.createBuffer();
  gl.bindVertexArray(null);
  gl.bindBuffer(target, handle);
  gl.bufferData(target, values, gl.STATIC_DRAW);
  return handle;
}

// How a texture is read: between its pixels, and at its border no farther.
function readSmoothly(gl) {
  for (const [name, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) gl.texParameteri(gl.TEXTURE_2D, name, value);
}

// A square picture that can be drawn into and read, of numbers of one format, as the attachment says.
function drawable(gl, side, format, attachment) {
  const texture = gl.createTexture(), frame = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, side, side);
  readSmoothly(gl);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, texture, 0);
  return { texture, frame, side };
}

// A square picture of one channel.
export function target(gl, side) {
  return drawable(gl, side, gl.R8, gl.COLOR_ATTACHMENT0);
}

// A square picture of depths alone: what is read from it is the share of four pixels about a place that lie no nearer
// than the depth given.
export function depthMap(gl, side) {
  const map = drawable(gl, side, gl.DEPTH_COMPONENT16, gl.DEPTH_ATTACHMENT);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_FUNC, gl.LEQUAL);
  gl.drawBuffers([gl.NONE]);
  gl.readBuffer(gl.NONE);
  return map;
}

// A picture of a user's character, its first row the upper one.
export function picture(gl, image) {
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.pixelStorei(gl.UNPACK_PREMULTIPLY_ALPHA_WEBGL, false);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
  readSmoothly(gl);
  return texture;
}

// Rows of floats that are written anew each picture, one an instance; fields: [attribute, width] in their order.
export class Rows {
  constructor(gl, program, fields) {
    this.gl = gl;
    this.program = program;
    this.buffer = gl.createBuffer();
    this.width = fields.reduce((sum, [, width]) => sum + width, 0);
    this.mesh = {};
    let offset = 0;
    for (const [name, width] of fields) {
      this.mesh[name] = { buffer: this.buffer, width, stride: 4 * this.width, offset: 4 * offset, divisor: 1 };
      offset += width;
    }
  }

  draw(rows, values) {
    if (!rows.length) return;
    const gl = this.gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(rows.flat()), gl.STREAM_DRAW);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    this.program.use(values).bind(this.mesh);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, rows.length);
  }
}
