// Draws bodies and tools: nearness, sums, light. No sorting.
import { Body, bind, carryProgram, framebuffer, program, texture } from "./body.js";
import { add, length, sub, unit } from "./camera.js";
import { BACKGROUND, BLEND, NEARNESS, POINT, RESOLVE, TOOL } from "./shaders.js";

/** What colours surfaces: the value of the last colour by size (m) and modulus (Pa), and the bit of what the server sends for it. */
export const COLORINGS = {
  tissue: { most: () => 1 },
  moved: { most: (size) => size / 8 },
  strain: { most: () => 0.5 },
  stress: { most: (_, modulus) => modulus / 4, bit: 1 },
  contact: { most: (_, modulus) => modulus / 2, bit: 2 },
};

export class Renderer {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "high-performance" });
    if (!gl) {
      throw new Error("This browser has no WebGL 2, which the picture needs.");
    }
    if (!gl.getExtension("EXT_color_buffer_float")) {
      throw new Error("This graphics card cannot draw into floating point pictures.");
    }
    this.blendsSingle = Boolean(gl.getExtension("EXT_float_blend"));
    this.gl = gl;
    this.canvas = canvas;
    this.carry = carryProgram(gl);
    Object.entries({ near: NEARNESS, blend: BLEND, resolve: RESOLVE, point: POINT, behind: BACKGROUND }).forEach(([name, source]) => (this[name] = program(gl, source)));
    this.tool = program(gl, TOOL);
    this.nothing = gl.createVertexArray();
    this.bodies = [];
    this.scene = null;
    this.supersampling = 1;
    /** 0: disks blend, with a relief finer than they are; 1: the nearest is seen alone, in one pass; 2: so are fewer and larger ones. */
    this.coarse = 0;
    this.size = [0, 0];
    /** Whether there is a floor below the bodies. */
    this.ground = true;
    /** What colours the surface: a name of COLORINGS. */
    this.coloring = "tissue";
  }

  /** Value of a scale's last colour, of one digit: of the bodies' size (m) and Young's modulus (Pa). */
  get most() {
    const { scene, coloring } = this;
    return Number(COLORINGS[coloring].most(length(sub(scene.high, scene.low)), scene.values[2]).toPrecision(1));
  }

  /** Takes what the nodes of a state have a number of that is shown as a colour. */
  setValues(state) {
    const { bit } = COLORINGS[this.coloring];
    const at = bit === 2 && state.values & 1 ? 1 : 0;
    this.bodies.forEach((body, k) => body?.setValues(bit && state.bodies[k] ? (state.values & bit ? state.bodies[k].values[at] : new Float32Array(1)) : null));
  }

  /** Name of the graphics card. */
  get card() {
    const info = this.gl.getExtension("WEBGL_debug_renderer_info");
    return String(this.gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : this.gl.RENDERER));
  }

  /** Whether pictures are drawn by the processor. */
  get isSoftware() {
    return /swiftshader|llvmpipe|software/i.test(this.card);
  }

  setScene(scene) {
    this.bodies.forEach((body) => body?.dispose());
    this.bodies = [];
    this.scene = scene;
  }

  addNodes({ body, count, rest }) {
    this.bodies[body] = new Body(this.gl, this.carry, count, rest, this.scene.bodies[body]);
  }

  /** Makes pictures in between as large as the canvas. */
  fit() {
    const { gl, canvas, coarse } = this;
    const [width, height] = [canvas.width * this.supersampling, canvas.height * this.supersampling];
    if (this.size[0] === width && this.size[1] === height && this.sums.length === (coarse ? 2 : 3)) {
      return;
    }
    this.size = [width, height];
    [this.seen, ...(this.sums ?? [])].forEach((made) => made && gl.deleteTexture(made));
    [this.first, this.second, this.third].forEach((made) => made && gl.deleteFramebuffer(made));
    this.seen = texture(gl, gl.DEPTH_COMPONENT32F, width, height);
    const formats = coarse ? [gl.RGBA8, gl.RGBA8] : [gl.RGBA16F, gl.RGBA16F, this.blendsSingle ? gl.RGBA32F : gl.RGBA16F];
    this.sums = formats.map((format) => texture(gl, format, width, height));
    this.first = framebuffer(gl, [], this.seen);
    this.second = framebuffer(gl, coarse ? [this.sums[0]] : this.sums, this.seen);
    this.third = coarse ? framebuffer(gl, [this.sums[1]], null) : null;
    this.backed = "";
  }

  /** Uses a program and sets what all need to know of the camera. */
  look({ made, uniforms }, camera) {
    const { gl } = this;
    gl.useProgram(made);
    const { right, up, forward } = camera.axes();
    gl.uniform3fv(uniforms.eye, camera.eye);
    gl.uniformMatrix3fv(uniforms.axes, false, [...right, ...up, ...forward.map((x) => -x)]);
    gl.uniform1f(uniforms.focal, camera.focal);
    gl.uniform1f(uniforms.aspect, this.size[0] / this.size[1]);
    gl.uniform1f(uniforms.nearest, 0.02 * camera.distance);
  }

  /** Draws all disks of all bodies as triangles, or as points; `gaps`: cut bodies' disks that face away too. */
  splats(used, camera, gaps) {
    const { gl } = this;
    const { uniforms } = used;
    this.look(used, camera);
    gl.uniform1f(uniforms.samples, this.size[1]);
    gl.uniform1f(uniforms.tolerance, this.scene.tolerance);
    gl.uniform1i(uniforms.coloring, Object.keys(COLORINGS).indexOf(this.coloring));
    gl.uniform1f(uniforms.most, this.most);
    for (const body of this.bodies.filter((body) => body.count > 0)) {
      const [carried0, carried1, carried2, carried3, carried4] = body.targets;
      bind(gl, uniforms, { carried0, carried1, carried2, carried3, shown: body.shown, clips: body.clips, records: body.records, ...(used === this.near ? {} : { carried4 }) });
      gl.uniform1i(uniforms.gaps, gaps && body.isCut);
      gl.uniform1i(uniforms.stride, body.stride);
      gl.uniform3fv(uniforms.inside, body.info.inside);
      gl.uniform4fv(uniforms.surfaces, surfacesOf(body.info));
      used === this.point ? gl.drawArrays(gl.POINTS, 0, body.count) : gl.drawArrays(gl.TRIANGLES, 0, 3 * body.count);
    }
  }

  /** Sets what the colours behind the bodies depend on. */
  setBehind(uniforms) {
    const { gl } = this;
    gl.uniform2fv(uniforms.size, this.size);
    gl.uniform3fv(uniforms.top, this.scene.background[0]);
    gl.uniform3fv(uniforms.bottom, this.scene.background[1]);
    const { low, high } = this.scene;
    const span = length(sub(high, low));
    gl.uniform4f(uniforms.ground, 0.5 * (low[0] + high[0]), 0.5 * (low[1] + high[1]), low[2] - 0.15 * span, this.ground ? 1.6 * span : 0);
    gl.uniform1f(uniforms.lines, 10 ** Math.round(Math.log10(span) - 0.8));
  }

  /** Draws everything. `tools`: meshes with position, turn, colour and opacities. */
  draw(camera, tools) {
    const { gl, canvas } = this;
    if (!this.scene) {
      return;
    }
    this.fit();
    gl.bindVertexArray(this.nothing);
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
    this.bodies.forEach((body) => body.update(camera.eye, this.coarse, this.scene.max_stretch));
    gl.viewport(0, 0, ...this.size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.first);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LEQUAL);
    this.coarse ? this.drawPoints(camera) : this.drawBlended(camera);
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    this.coarse || this.drawResolved(camera);
    this.drawTools(camera, tools);
    gl.bindVertexArray(null);
  }

  drawPoints(camera) {
    const { gl, canvas } = this;
    // What is behind changes with the view alone.
    const view = [...camera.eye, ...camera.target, camera.focal, ...this.size, this.ground].join();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.third);
    if (this.backed !== view) {
      this.backed = view;
      gl.disable(gl.DEPTH_TEST);
      this.look(this.behind, camera);
      this.setBehind(this.behind.uniforms);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      gl.enable(gl.DEPTH_TEST);
    }
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.second);
    gl.blitFramebuffer(0, 0, ...this.size, 0, 0, ...this.size, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.second);
    this.splats(this.point, camera, true);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.blitFramebuffer(0, 0, ...this.size, 0, 0, canvas.width, canvas.height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
  }

  drawBlended(camera) {
    const { gl } = this;
    this.splats(this.near, camera, false);
    gl.depthMask(false);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.second);
    this.sums.forEach((_, k) => gl.clearBufferfv(gl.COLOR, k, [0, 0, 0, 0]));
    this.splats(this.blend, camera, true);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }

  drawResolved(camera) {
    const { gl } = this;
    const { uniforms } = this.resolve;
    this.look(this.resolve, camera);
    bind(gl, uniforms, { sumNormal: this.sums[0], sumColor: this.sums[1], sumPoint: this.sums[2] });
    gl.uniform1i(uniforms.supersampling, this.supersampling);
    gl.uniform4fv(uniforms.surfaces, surfacesOf(this.scene.bodies[0]));
    this.setBehind(uniforms);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /** What the card comes to when all is drawn that it was told to draw. */
  fence() {
    const { gl } = this;
    const made = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    return made;
  }

  /** Whether the card has come to a fence, which is gone then. */
  isDone(fence) {
    const { gl } = this;
    const done = gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.SIGNALED;
    done && gl.deleteSync(fence);
    return done;
  }

  drawTools(camera, tools) {
    if (tools.length === 0) {
      return;
    }
    const { gl } = this;
    gl.clearDepth(1);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    this.look(this.tool, camera);
    const { uniforms } = this.tool;
    bind(gl, uniforms, { seen: this.seen });
    gl.uniform1i(uniforms.supersampling, this.supersampling);
    for (const tool of tools) {
      gl.uniform3fv(uniforms.place, tool.place);
      gl.uniform4fv(uniforms.turn, tool.turn);
      gl.uniform3fv(uniforms.color, tool.color);
      gl.uniform1f(uniforms.specular, tool.specular ?? 0.9);
      gl.uniform1f(uniforms.opacity, tool.opacity ?? 1);
      gl.uniform1f(uniforms.hiddenOpacity, tool.hidden ?? 0.18);
      gl.bindVertexArray(tool.mesh.array);
      gl.drawArrays(gl.TRIANGLES, 0, tool.mesh.count);
    }
    gl.disable(gl.BLEND);
    gl.disable(gl.DEPTH_TEST);
  }

  /** Tissue along a ray of the camera: its depth (m) and outward normal, blended as the picture is; null for none. */
  pick(eye, ray) {
    const hits = this.bodies.flatMap((body) => body.hits(eye, ray, this.scene.spacing));
    if (hits.length === 0) {
      return null;
    }
    const depth = Math.min(...hits.map((hit) => hit.depth));
    const near = hits.filter((hit) => hit.depth < depth + 0.5 * this.scene.spacing);
    const normal = near.reduce((sum, hit) => add(sum, hit.normal, hit.weight), [0, 0, 0]);
    return { depth, normal: unit(normal) };
  }
}

function surfacesOf(info) {
  const numbers = new Float32Array(16);
  info.surfaces.slice(0, 4).forEach((surface, k) => numbers.set(surface, 4 * k));
  return numbers;
}
