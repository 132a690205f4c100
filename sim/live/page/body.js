// A body on the graphics card: its nodes' maps, its surfels at rest, and the surfels where nodes have carried them.
import { add, cross, dot, scale, sub, unit } from "./camera.js";
import { halfValue } from "./protocol.js";
import { CARRY } from "./shaders.js";

const NODES_PER_ROW = 341;
const SURFELS_PER_ROW = 64;
const CLIPS_PER_ROW = 1024;
/** Texels of a surfel's own; then one for each of its nodes. */
const OWN = 4;
/** Size of surfels that stand for others over what it was, and the part of those others' radii that they must cover. */
const LARGER = 2;
const COVERED = 0.8;
/** Targets that carried surfels are drawn into. */
const TARGETS = 5;

/** Values of all numbers of half precision: a table is ten times as fast as their arithmetic. */
const HALVES = Float32Array.from({ length: 1 << 16 }, (_, bits) => halfValue(bits));

export function program(gl, { vertex, fragment }) {
  const made = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
      throw new Error(gl.getShaderInfoLog(shader));
    }
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) {
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

/** A framebuffer of these textures. */
export function framebuffer(gl, colors, depth) {
  const made = gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, made);
  colors.forEach((color, k) => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, color, 0));
  depth && gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth, 0);
  gl.drawBuffers(colors.map((_, k) => gl.COLOR_ATTACHMENT0 + k));
  if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost()) {
    throw new Error("This graphics card cannot draw into the pictures that are needed.");
  }
  return made;
}

/** Binds textures to the uniforms that name them. */
export function bind(gl, uniforms, textures) {
  Object.entries(textures).forEach(([name, made], unit) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.uniform1i(uniforms[name], unit);
  });
  gl.activeTexture(gl.TEXTURE0);
}

/** Rows \`top\` to \`bottom\` of a texture of four numbers a texel, \`width\` texels wide. */
function upload(gl, made, width, top, bottom, numbers) {
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, top, width, bottom - top, gl.RGBA, gl.FLOAT, numbers, 4 * width * top);
}

export class Body {
  constructor(gl, carry, count, rest, info) {
    this.gl = gl;
    this.carry = carry;
    this.info = info;
    this.rest = rest;
    this.surfels = 0;
    /** Surfels that are drawn. */
    this.count = 0;
    this.room = 0;
    this.stride = 0;
    this.nodeRows = Math.ceil(count / NODES_PER_ROW);
    // Of each node the rows of F and of a = x - F X: a surfel is carried to the mean of F X + a.
    this.maps = new Float32Array(12 * NODES_PER_ROW * this.nodeRows);
    this.nodes = texture(gl, gl.RGBA32F, 3 * NODES_PER_ROW, this.nodeRows);
    // A number of each node that is shown as a colour, where there is one.
    this.values = texture(gl, gl.R32F, NODES_PER_ROW, this.nodeRows);
    this.numbersOfNodes = new Float32Array(NODES_PER_ROW * this.nodeRows);
    this.valued = false;
    this.records = null;
    this.numbers = new Float32Array(0);
    this.changed = [Infinity, 0];
    this.targets = [];
    /** Which surfels are drawn, and which stand for others where few are; their positions at rest never change. */
    this.shown = null;
    this.few = null;
    this.seenFrom = "";
    this.marked = new Uint8Array(count);
    this.clipNumbers = new Float32Array(4 * CLIPS_PER_ROW);
    this.clipUsed = 0;
    this.clipOf = new Map();
    this.clips = texture(gl, gl.RGBA32F, CLIPS_PER_ROW, 1);
    this.clipRows = 1;
    this.move({ positions: rest, gradients: new Uint16Array(9 * count) });
  }

  get each() {
    return OWN + this.stride;
  }

  dispose() {
    const { gl } = this;
    [this.nodes, this.values, this.records, this.shown, this.clips, ...this.targets].forEach((made) => made && gl.deleteTexture(made));
    gl.deleteFramebuffer(this.frame);
  }

  /** Takes nodes over: positions, and F − 1 in half precision, column by column. */
  move({ positions, gradients }) {
    const { gl, maps, rest } = this;
    for (let at = 0, g = 0, to = 0; at < rest.length; at += 3, g += 9, to += 12) {
      for (let row = 0; row < 3; row += 1) {
        let moved = positions[at + row];
        for (let column = 0; column < 3; column += 1) {
          const f = HALVES[gradients[g + 3 * column + row]] + (row === column ? 1 : 0);
          maps[to + 4 * row + column] = f;
          moved -= f * rest[at + column];
        }
        maps[to + 4 * row + 3] = moved;
      }
    }
    upload(gl, this.nodes, 3 * NODES_PER_ROW, 0, this.nodeRows, maps);
    this.stale = true;
  }

  /** Takes a number of each node over that is shown as a colour; null for none. */
  setValues(values) {
    const { gl } = this;
    this.valued = values !== null;
    this.stale = true;
    if (this.valued) {
      this.numbersOfNodes.fill(0).set(values);
      gl.bindTexture(gl.TEXTURE_2D, this.values);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, NODES_PER_ROW, this.nodeRows, gl.RED, gl.FLOAT, this.numbersOfNodes);
    }
  }

  /** Takes surfels over: new ones, or others instead of those that were there. */
  skin({ first, count, stride, numbers }) {
    this.stride = stride;
    const end = first + count;
    this.reserve(end);
    this.numbers.set(numbers, 4 * this.each * first);
    this.surfels = Math.max(this.surfels, end);
    for (let surfel = first; surfel < end; surfel += 1) {
      this.mark(surfel);
    }
  }

  /** Writes down where a surfel's clip is, in a position of its record that is free for it. */
  mark(surfel) {
    const clip = this.clipOf.get(surfel);
    this.numbers[4 * (this.each * surfel + 3) + 3] = clip ? clip.at + 1 : 0;
    this.changed = [Math.min(this.changed[0], surfel), Math.max(this.changed[1], surfel + 1)];
  }

  /** Makes room for so many surfels. */
  reserve(end) {
    if (end <= this.room) {
      return;
    }
    const { gl, each } = this;
    const rows = Math.ceil(Math.max(end, 1.5 * this.room) / SURFELS_PER_ROW);
    this.room = rows * SURFELS_PER_ROW;
    const grown = new Float32Array(4 * each * this.room);
    grown.set(this.numbers);
    this.numbers = grown;
    [this.records, this.shown, ...this.targets].forEach((made) => made && gl.deleteTexture(made));
    this.frame && gl.deleteFramebuffer(this.frame);
    this.records = texture(gl, gl.RGBA32F, SURFELS_PER_ROW * each, rows);
    this.shown = texture(gl, gl.RG32F, SURFELS_PER_ROW, rows);
    this.list = new Float32Array(2 * this.room);
    this.targets = Array.from({ length: TARGETS }, () => texture(gl, gl.RGBA32F, SURFELS_PER_ROW, rows));
    this.frame = framebuffer(gl, this.targets, null);
    this.changed[0] = 0;
  }

  /** Takes clips over. One that grew gets another position. */
  clip({ clips }) {
    for (const { surfel, anchor, edges, walls } of clips) {
      for (let link = 0; link < this.stride; link += 1) {
        this.marked[this.numbers[4 * (this.each * surfel + OWN + link)]] = 1;
      }
      const texels = 1 + edges.length / 3 + walls.length / 4;
      let place = this.clipOf.get(surfel);
      if (!place || place.texels < texels) {
        place = { at: this.clipUsed, texels };
        this.clipUsed += texels;
        this.clipOf.set(surfel, place);
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
      this.mark(surfel);
    }
    this.clipsStale = clips.length > 0;
  }

  /** Brings records and clips up to date on the card. */
  refresh() {
    const { gl, each, changed } = this;
    if (changed[1] > changed[0]) {
      const [top, bottom] = [Math.floor(changed[0] / SURFELS_PER_ROW), Math.ceil(changed[1] / SURFELS_PER_ROW)];
      upload(gl, this.records, SURFELS_PER_ROW * each, top, bottom, this.numbers);
      this.changed = [Infinity, 0];
      this.stale = true;
    }
    if (this.clipsStale) {
      this.clipsStale = false;
      const rows = this.clipNumbers.length / (4 * CLIPS_PER_ROW);
      if (this.clipRows !== rows) {
        gl.deleteTexture(this.clips);
        this.clips = texture(gl, gl.RGBA32F, CLIPS_PER_ROW, rows);
        this.clipRows = rows;
      }
      upload(gl, this.clips, CLIPS_PER_ROW, 0, Math.ceil(this.clipUsed / CLIPS_PER_ROW), this.clipNumbers);
    }
  }

  get isCut() {
    return this.surfels > this.info.outer;
  }

  /** Surfels of the uncut surface that, LARGER, lie over the middles of all others, which leaves no gaps. */
  sparse() {
    const n = this.numbers;
    const step = 4 * this.each;
    const chosen = new Uint8Array(this.info.outer);
    const end = step * chosen.length;
    let largest = 0;
    for (let at = 0; at < end; at += step) {
      largest = Math.max(largest, n[at + 3]);
    }
    const size = (LARGER - COVERED) * largest;
    const cells = new Map();
    const key = (x, y, z) => (x * 4093 + y) * 4093 + z;
    // A disk lies under one that faces the same way and reaches over most of it.
    const under = (at, other) => {
      const apart = Math.hypot(n[other] - n[at], n[other + 1] - n[at + 1], n[other + 2] - n[at + 2]);
      return apart < LARGER * n[other + 3] - COVERED * n[at + 3] && n[other + 4] * n[at + 4] + n[other + 5] * n[at + 5] + n[other + 6] * n[at + 6] > 0;
    };
    for (let at = 0; at < end; at += step) {
      const [x, y, z] = [Math.floor(n[at] / size), Math.floor(n[at + 1] / size), Math.floor(n[at + 2] / size)];
      let free = true;
      for (let i = 0; free && i < 27; i += 1) {
        const others = cells.get(key(x + (i % 3) - 1, y + (Math.floor(i / 3) % 3) - 1, z + Math.floor(i / 9) - 1));
        free = !others?.some((other) => under(at, other));
      }
      if (free) {
        chosen[at / step] = 1;
        const own = key(x, y, z);
        cells.has(own) ? cells.get(own).push(at) : cells.set(own, [at]);
      }
    }
    return chosen;
  }

  /** Lists the surfels that are drawn: all, those that may be seen, or (2) few and large ones of these except near cuts. */
  choose(eye, coarse) {
    const { list, numbers, marked, isCut } = this;
    const { outer } = this.info;
    if (coarse > 0 && this.surfels >= outer) {
      this.few ??= this.sparse();
    }
    const step = 4 * this.each;
    let to = 0;
    for (let k = 0, at = 0; k < this.surfels; k += 1, at += step) {
      const node = numbers[at + 4 * OWN];
      const few = coarse > 0 && this.few?.[k] === 1;
      const exact = coarse < 2 || k >= outer || marked[node] === 1;
      // What faces away fills gaps of cut bodies.
      if (!(exact || few) || (coarse > 0 && !(isCut && few) && this.facesAway(at, 12 * node, eye))) {
        continue;
      }
      list[to] = k;
      list[to + 1] = exact ? 1 : LARGER;
      to += 2;
    }
    this.count = to / 2;
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.shown);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, SURFELS_PER_ROW, Math.ceil(this.count / SURFELS_PER_ROW), gl.RG, gl.FLOAT, list);
  }

  /** Whether a surfel faces away from the eye for certain, where its first node takes it. */
  facesAway(at, m, eye) {
    const { numbers: n, maps: f } = this;
    const [x, y, z] = [n[at], n[at + 1], n[at + 2]];
    const px = f[m] * x + f[m + 1] * y + f[m + 2] * z + f[m + 3] - eye[0];
    const py = f[m + 4] * x + f[m + 5] * y + f[m + 6] * z + f[m + 7] - eye[1];
    const pz = f[m + 8] * x + f[m + 9] * y + f[m + 10] * z + f[m + 11] - eye[2];
    // Normals are carried by cofactors.
    const [nx, ny, nz] = [n[at + 4], n[at + 5], n[at + 6]];
    const cx = (f[m + 5] * f[m + 10] - f[m + 6] * f[m + 9]) * nx + (f[m + 6] * f[m + 8] - f[m + 4] * f[m + 10]) * ny + (f[m + 4] * f[m + 9] - f[m + 5] * f[m + 8]) * nz;
    const cy = (f[m + 9] * f[m + 2] - f[m + 10] * f[m + 1]) * nx + (f[m + 10] * f[m] - f[m + 8] * f[m + 2]) * ny + (f[m + 8] * f[m + 1] - f[m + 9] * f[m]) * nz;
    const cz = (f[m + 1] * f[m + 6] - f[m + 2] * f[m + 5]) * nx + (f[m + 2] * f[m + 4] - f[m] * f[m + 6]) * ny + (f[m] * f[m + 5] - f[m + 1] * f[m + 4]) * nz;
    const along = px * cx + py * cy + pz * cz;
    return along > 0 && along * along > 0.09 * (px * px + py * py + pz * pz) * (cx * cx + cy * cy + cz * cz);
  }

  /** Carries the surfels that are drawn to where the nodes are: each is a texel of five targets. */
  update(eye, coarse, maxStretch) {
    this.refresh();
    // All are drawn from everywhere.
    const from = coarse > 0 ? [coarse, ...eye].join() : "";
    if (this.surfels === 0 || (!this.stale && this.seenFrom === from)) {
      return;
    }
    if (coarse > 0 || this.seenFrom !== from || this.count !== this.surfels) {
      this.choose(eye, coarse);
    }
    this.seenFrom = from;
    this.stale = false;
    const { gl, carry } = this;
    gl.useProgram(carry.made);
    bind(gl, carry.uniforms, { records: this.records, nodes: this.nodes, shown: this.shown, values: this.values });
    gl.uniform1i(carry.uniforms.valued, this.valued);
    gl.uniform1i(carry.uniforms.stride, this.stride);
    gl.uniform1f(carry.uniforms.maxStretch, maxStretch);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame);
    gl.viewport(0, 0, SURFELS_PER_ROW, Math.ceil(this.count / SURFELS_PER_ROW));
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** Where the card has carried the surfels: numbers of one target, four each; for tests. */
  carried(target) {
    const { gl } = this;
    const rows = Math.ceil(this.surfels / SURFELS_PER_ROW);
    const numbers = new Float32Array(4 * SURFELS_PER_ROW * rows);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.frame);
    gl.readBuffer(gl.COLOR_ATTACHMENT0 + target);
    gl.readPixels(0, 0, SURFELS_PER_ROW, rows, gl.RGBA, gl.FLOAT, numbers);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
    return numbers.subarray(0, 4 * this.surfels);
  }

  /** Where a node's map takes a position at rest. */
  mapped(node, [x, y, z]) {
    const m = this.maps;
    const at = 12 * node;
    return [0, 4, 8].map((row) => m[at + row] * x + m[at + row + 1] * y + m[at + row + 2] * z + m[at + row + 3]);
  }

  /** A surfel where its nodes carry it, as the card does: centre, the two axes of its disk, normal. */
  surfel(index) {
    const { numbers, maps } = this;
    const at = 4 * this.each * index;
    const own = (k) => Array.from(numbers.subarray(at + 4 * k, at + 4 * k + 3));
    const [rest, normal] = [own(0), own(1)];
    const radius = numbers[at + 3];
    const sign = 1 / normal[2] < 0 ? -1 : 1;
    const a = -1 / (sign + normal[2]);
    const t0 = [normal[0] * normal[1] * a, sign + normal[1] * normal[1] * a, -normal[1]];
    const tangents = [t0, cross(normal, t0)];
    const first = this.mapped(numbers[at + 4 * OWN], rest);
    let center = first;
    const axes = [[0, 0, 0], [0, 0, 0]];
    const turned = [[0, 0, 0], [0, 0, 0]];
    for (let link = at + 4 * OWN; link < at + 4 * this.each; link += 4) {
      const weight = numbers[link + 1];
      const m = 12 * numbers[link];
      const aside = sub(this.mapped(numbers[link], rest), first);
      center = add(center, aside, weight);
      for (const side of [0, 1]) {
        const t = tangents[side];
        const carried = [m, m + 4, m + 8].map((row) => maps[row] * t[0] + maps[row + 1] * t[1] + maps[row + 2] * t[2]);
        turned[side] = add(turned[side], carried, weight);
        axes[side] = add(axes[side], add(scale(carried, weight), aside, numbers[link + 2 + side]), radius);
      }
    }
    return { center, axes, normal: unit(cross(...turned)), radius };
  }

  /** Disks under the ray \`eye + depth · ray\` that face it: depth, weight in the blend and normal; \`spacing\` (m) of the nodes. */
  hits(eye, ray, spacing) {
    const { numbers, maps } = this;
    const hits = [];
    const square = dot(ray, ray);
    for (let k = 0, at = 0; k < this.surfels; k += 1, at += 4 * this.each) {
      // Where the surfel's first node takes it is near enough to leave most aside.
      const [x, y, z, m] = [numbers[at], numbers[at + 1], numbers[at + 2], 12 * numbers[at + 4 * OWN]];
      const px = maps[m] * x + maps[m + 1] * y + maps[m + 2] * z + maps[m + 3] - eye[0];
      const py = maps[m + 4] * x + maps[m + 5] * y + maps[m + 6] * z + maps[m + 7] - eye[1];
      const pz = maps[m + 8] * x + maps[m + 9] * y + maps[m + 10] * z + maps[m + 11] - eye[2];
      const along = px * ray[0] + py * ray[1] + pz * ray[2];
      const reach = 2 * numbers[at + 3] + 0.5 * spacing;
      if (px * px + py * py + pz * pz - (along * along) / square > reach * reach) {
        continue;
      }
      const { center, axes: [u, v], normal, radius } = this.surfel(k);
      const arm = sub(center, eye);
      if (dot(normal, arm) >= 0) {
        continue;
      }
      // eye + depth ray = center + p u + q v, by Cramer's rule.
      const across = cross(u, v);
      const volume = dot(ray, across);
      const depth = dot(arm, across) / volume;
      const p = -dot(ray, cross(arm, v)) / volume;
      const q = -dot(ray, cross(u, arm)) / volume;
      const fall = 1 - p * p - q * q;
      if (fall > 0 && depth > 0 && !this.isHidden(numbers[at + 15] - 1, p * radius, q * radius)) {
        hits.push({ depth, weight: fall * fall, normal });
      }
    }
    return hits;
  }

  /** Whether a point of a disk is beyond an edge or behind a wall of its clip, as the card computes it. */
  isHidden(clip, x, y) {
    if (clip < 0) {
      return false;
    }
    const n = this.clipNumbers;
    let at = 4 * clip;
    const [ax, ay, edges, walls] = n.subarray(at, at + 4);
    const turn = (ux, uy, vx, vy) => ux * vy - uy * vx;
    for (let k = 0; k < edges; k += 1) {
      at += 4;
      if (n[at + 2] < x * n[at] + y * n[at + 1]) {
        return true;
      }
    }
    const [qx, qy] = [x - ax, y - ay];
    for (let k = 0; k < walls; k += 1) {
      at += 4;
      let [bx, by, cx, cy] = [n[at] - ax, n[at + 1] - ay, n[at + 2] - ax, n[at + 3] - ay];
      if (turn(bx, by, cx, cy) < 0) {
        [bx, by, cx, cy] = [cx, cy, bx, by];
      }
      const between = turn(bx, by, qx, qy) >= 0 && turn(qx, qy, cx, cy) >= 0;
      if (between && turn(cx - bx, cy - by, qx - bx, qy - by) < 0) {
        return true;
      }
    }
    return false;
  }
}

export const carryProgram = (gl) => program(gl, CARRY);
