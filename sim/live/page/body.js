// A body on the graphics card: nodes, surfels, clips, and the surfels where nodes have carried them.
import { CARRY } from "./shaders.js";

const NODES_PER_ROW = 1024;
const GRADIENTS_PER_ROW = 341;
const SURFELS_PER_ROW = 64;
const CLIPS_PER_ROW = 1024;
const OWN = 4;
/** Numbers of a carried surfel. */
export const CARRIED = 18;

export function program(gl, { vertex, fragment, feedback }) {
  const made = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.attachShader(made, shader);
  }
  if (feedback) {
    gl.transformFeedbackVaryings(made, feedback, gl.INTERLEAVED_ATTRIBS);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) {
    throw new Error(gl.getProgramInfoLog(made));
  }
  const uniforms = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k += 1) {
    const { name } = gl.getActiveUniform(made, k);
    uniforms[name.replace("[0]", "")] = gl.getUniformLocation(made, name);
  }
  return { made, uniforms };
}

export function texture(gl, format, width, height) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
    gl.texParameteri(gl.TEXTURE_2D, filter, gl.NEAREST);
  }
  return made;
}

/** Fills a texture of \`width\` with \`count\` units of \`each\` texels, row by row from its beginning. */
function fill(gl, made, width, perRow, each, count, format, type, data, numbers) {
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  const rows = Math.floor(count / perRow);
  if (rows > 0) {
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, perRow * each, rows, format, type, data, 0);
  }
  const left = count - rows * perRow;
  if (left > 0) {
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, rows, left * each, 1, format, type, data, rows * perRow * each * numbers);
  }
}

export class Body {
  constructor(gl, carry, count, rest, info) {
    this.gl = gl;
    this.carry = carry;
    this.info = info;
    this.nodeCount = count;
    this.surfels = 0;
    this.room = 0;
    this.stride = 0;
    const rows = Math.ceil(count / NODES_PER_ROW);
    this.rest = texture(gl, gl.RGB32F, NODES_PER_ROW, rows);
    this.nodes = texture(gl, gl.RGB32F, NODES_PER_ROW, rows);
    this.gradients = texture(gl, gl.RGB16F, 3 * GRADIENTS_PER_ROW, Math.ceil(count / GRADIENTS_PER_ROW));
    fill(gl, this.rest, NODES_PER_ROW, NODES_PER_ROW, 1, count, gl.RGB, gl.FLOAT, rest, 3);
    this.move({ positions: rest, gradients: new Uint16Array(9 * count) });
    this.records = null;
    this.numbers = new Float32Array(0);
    this.clipAt = new Float32Array(0);
    this.clipNumbers = new Float32Array(4 * CLIPS_PER_ROW);
    this.clipUsed = 0;
    this.clipRoom = new Map();
    this.clips = null;
    this.clipped = 0;
    this.feedback = gl.createTransformFeedback();
    this.empty = gl.createVertexArray();
    this.array = null;
  }

  dispose() {
    const { gl } = this;
    [this.rest, this.nodes, this.gradients, this.records, this.clips].forEach((made) => made && gl.deleteTexture(made));
    [this.buffer, this.clipBuffer].forEach((made) => made && gl.deleteBuffer(made));
    gl.deleteTransformFeedback(this.feedback);
    [this.array, this.empty].forEach((made) => made && gl.deleteVertexArray(made));
  }

  /** Takes nodes over. */
  move({ positions, gradients }) {
    const { gl } = this;
    const count = this.nodeCount;
    fill(gl, this.nodes, NODES_PER_ROW, NODES_PER_ROW, 1, count, gl.RGB, gl.FLOAT, positions, 3);
    fill(gl, this.gradients, 0, GRADIENTS_PER_ROW, 3, count, gl.RGB, gl.HALF_FLOAT, gradients, 3);
    this.stale = true;
  }

  /** Takes surfels over: new ones, or others in place of those that were there. */
  skin({ first, count, stride, numbers }) {
    this.stride = stride;
    const each = OWN + stride;
    const end = first + count;
    this.reserve(end, 4 * each);
    this.numbers.set(numbers, first * 4 * each);
    this.surfels = Math.max(this.surfels, end);
    const { gl } = this;
    const [top, bottom] = [Math.floor(first / SURFELS_PER_ROW), Math.ceil(end / SURFELS_PER_ROW)];
    gl.bindTexture(gl.TEXTURE_2D, this.records);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, top, SURFELS_PER_ROW * each, bottom - top, gl.RGBA, gl.FLOAT, this.numbers, top * SURFELS_PER_ROW * 4 * each);
    this.stale = true;
  }

  /** Makes room for so many surfels. */
  reserve(end, numbers) {
    if (end <= this.room) {
      return;
    }
    const { gl } = this;
    const room = Math.ceil(Math.max(end, 1.5 * this.room) / SURFELS_PER_ROW) * SURFELS_PER_ROW;
    const grown = new Float32Array(room * numbers);
    grown.set(this.numbers);
    this.numbers = grown;
    const clipAt = new Float32Array(room).fill(-1);
    clipAt.set(this.clipAt);
    this.clipAt = clipAt;
    this.room = room;
    if (this.records) {
      gl.deleteTexture(this.records);
      gl.deleteBuffer(this.buffer);
      gl.deleteBuffer(this.clipBuffer);
      gl.deleteVertexArray(this.array);
    }
    const rows = room / SURFELS_PER_ROW;
    this.records = texture(gl, gl.RGBA32F, (SURFELS_PER_ROW * numbers) / 4, rows);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, (SURFELS_PER_ROW * numbers) / 4, rows, gl.RGBA, gl.FLOAT, this.numbers);
    this.buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, 4 * CARRIED * room, gl.DYNAMIC_COPY);
    this.clipBuffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.clipBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, this.clipAt, gl.DYNAMIC_DRAW);
    this.array = gl.createVertexArray();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    for (let k = 0; k < 6; k += 1) {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 4 * CARRIED, 12 * k);
      gl.vertexAttribDivisor(k, 1);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.clipBuffer);
    gl.enableVertexAttribArray(6);
    gl.vertexAttribPointer(6, 1, gl.FLOAT, false, 4, 0);
    gl.vertexAttribDivisor(6, 1);
    gl.bindVertexArray(null);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
  }

  /** Takes clips over. One that grew gets another place. */
  clip({ clips }) {
    for (const { surfel, anchor, edges, walls } of clips) {
      const texels = 1 + edges.length / 3 + walls.length / 4;
      let place = this.clipRoom.get(surfel);
      if (!place || place.texels < texels) {
        place = { at: this.clipUsed, texels };
        this.clipUsed += texels;
        this.clipped += this.clipAt[surfel] < 0 ? 1 : 0;
        this.clipRoom.set(surfel, place);
        this.clipAt[surfel] = place.at;
      }
      while (4 * this.clipUsed > this.clipNumbers.length) {
        const grown = new Float32Array(2 * this.clipNumbers.length);
        grown.set(this.clipNumbers);
        this.clipNumbers = grown;
      }
      const n = this.clipNumbers;
      let at = 4 * place.at;
      n.set([anchor[0], anchor[1], edges.length / 3, walls.length / 4], at);
      for (let k = 0; k < edges.length; k += 3) {
        n.set([edges[k], edges[k + 1], edges[k + 2], 0], (at += 4));
      }
      for (let k = 0; k < walls.length; k += 4) {
        n.set([walls[k], walls[k + 1], walls[k + 2], walls[k + 3]], (at += 4));
      }
    }
    this.clipsStale = clips.length > 0;
  }

  uploadClips() {
    if (!this.clipsStale) {
      return;
    }
    this.clipsStale = false;
    const { gl } = this;
    const rows = this.clipNumbers.length / (4 * CLIPS_PER_ROW);
    if (this.clipRows !== rows) {
      this.clips && gl.deleteTexture(this.clips);
      this.clips = texture(gl, gl.RGBA32F, CLIPS_PER_ROW, rows);
      this.clipRows = rows;
    }
    gl.bindTexture(gl.TEXTURE_2D, this.clips);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
    const used = Math.ceil(this.clipUsed / CLIPS_PER_ROW);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, CLIPS_PER_ROW, used, gl.RGBA, gl.FLOAT, this.clipNumbers);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.clipBuffer);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.clipAt);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
  }

  /** Carries the surfels to where the nodes are. */
  update(maxStretch) {
    this.uploadClips();
    if (!this.stale || this.surfels === 0) {
      return;
    }
    this.stale = false;
    const { gl, carry } = this;
    gl.useProgram(carry.made);
    const { uniforms } = carry;
    [[this.records, "records"], [this.rest, "restNodes"], [this.nodes, "nodes"], [this.gradients, "gradients"]].forEach(([made, name], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, made);
      gl.uniform1i(uniforms[name], unit);
    });
    gl.uniform1i(uniforms.stride, this.stride);
    gl.uniform1f(uniforms.maxStretch, maxStretch);
    gl.bindVertexArray(this.empty);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, this.feedback);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, this.buffer);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, this.surfels);
    gl.endTransformFeedback();
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
    gl.disable(gl.RASTERIZER_DISCARD);
    gl.bindVertexArray(null);
    gl.activeTexture(gl.TEXTURE0);
  }

  /** Where the surfels are: 18 numbers each; for tests. */
  carried() {
    const { gl } = this;
    const numbers = new Float32Array(CARRIED * this.surfels);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.getBufferSubData(gl.ARRAY_BUFFER, 0, numbers);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    return numbers;
  }
}

export const carryProgram = (gl) => program(gl, CARRY);
