// Draws bodies and tools: nearness, sums, light. No sorting.
import { Body, carryProgram, program, texture } from "./body.js";
import { RESOLVE, TOOL, blend, nearness } from "./shaders.js";

export class Renderer {
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: true, powerPreference: "high-performance" });
    if (!gl) {
      throw new Error("This browser has no WebGL 2, which the picture needs.");
    }
    if (!gl.getExtension("EXT_color_buffer_float")) {
      throw new Error("This graphics card cannot draw into floating point pictures.");
    }
    this.fine = Boolean(gl.getExtension("EXT_float_blend"));
    this.gl = gl;
    this.canvas = canvas;
    this.carry = carryProgram(gl);
    this.near = [false, true].map((clipped) => program(gl, nearness(clipped)));
    this.blend = [false, true].map((clipped) => program(gl, blend(clipped)));
    this.resolve = program(gl, RESOLVE);
    this.tool = program(gl, TOOL);
    this.nothing = gl.createVertexArray();
    this.bodies = [];
    this.scene = null;
    this.supersampling = 1;
    this.size = [0, 0];
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

  /** Makes the pictures in between as large as the canvas. */
  fit() {
    const { gl, canvas } = this;
    const [width, height] = [canvas.width * this.supersampling, canvas.height * this.supersampling];
    if (this.size[0] === width && this.size[1] === height) {
      return;
    }
    this.size = [width, height];
    [this.seen, this.depth, ...(this.sums ?? [])].forEach((made) => made && gl.deleteTexture(made));
    [this.first, this.second].forEach((made) => made && gl.deleteFramebuffer(made));
    this.seen = texture(gl, gl.R32F, width, height);
    this.depth = texture(gl, gl.DEPTH_COMPONENT32F, width, height);
    this.sums = [gl.RGBA16F, gl.RGBA16F, this.fine ? gl.RGBA32F : gl.RGBA16F].map((format) => texture(gl, format, width, height));
    const framebuffer = (colors, depth) => {
      const made = gl.createFramebuffer();
      gl.bindFramebuffer(gl.FRAMEBUFFER, made);
      colors.forEach((color, k) => gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, color, 0));
      depth && gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth, 0);
      gl.drawBuffers(colors.map((_, k) => gl.COLOR_ATTACHMENT0 + k));
      if (gl.checkFramebufferStatus(gl.FRAMEBUFFER) !== gl.FRAMEBUFFER_COMPLETE) {
        throw new Error("This graphics card cannot draw into the pictures that are needed.");
      }
      return made;
    };
    this.first = framebuffer([this.seen], this.depth);
    this.second = framebuffer(this.sums, null);
  }

  /** Sets what both kinds of programs need to know of the camera. */
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

  /** Draws all disks of all bodies with one kind of program. */
  splats(programs, camera, away, gapsOnly) {
    const { gl } = this;
    for (const clipped of [0, 1]) {
      for (const body of this.bodies) {
        const cut = body.surfels > body.info.outer;
        if (body.surfels === 0 || (clipped && body.clipped === 0) || (gapsOnly && !cut)) {
          continue;
        }
        const used = programs[clipped];
        const { uniforms } = used;
        this.look(used, camera);
        gl.uniform1f(uniforms.samples, this.size[1]);
        gl.uniform1f(uniforms.tolerance, this.scene.tolerance);
        gl.uniform1i(uniforms.away, away);
        gl.uniform1i(uniforms.stride, body.stride);
        gl.uniform3fv(uniforms.inside, body.info.inside);
        gl.uniform4fv(uniforms.surfaces, surfacesOf(body.info));
        this.bind([[body.records, uniforms.records], [clipped ? body.clips : null, uniforms.clips], [away || programs === this.blend ? this.seen : null, uniforms.seen]]);
        gl.bindVertexArray(body.array);
        gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, body.surfels);
      }
    }
  }

  bind(textures) {
    const { gl } = this;
    textures.forEach(([made, uniform], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, made);
      made && gl.uniform1i(uniform, unit);
    });
    gl.activeTexture(gl.TEXTURE0);
  }

  /** Draws everything. \`tools\`: meshes with place, turn, colour and opacities. */
  draw(camera, tools) {
    const { gl } = this;
    if (!this.scene) {
      return;
    }
    this.fit();
    this.bodies.forEach((body) => body.update(this.scene.max_stretch));
    gl.viewport(0, 0, ...this.size);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.first);
    gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
    gl.disable(gl.BLEND);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    this.splats(this.near, camera, 0, false);
    gl.disable(gl.DEPTH_TEST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.second);
    [0, 1, 2].forEach((k) => gl.clearBufferfv(gl.COLOR, k, [0, 0, 0, 0]));
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    this.splats(this.blend, camera, 0, false);
    this.splats(this.blend, camera, 1, true);
    gl.disable(gl.BLEND);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    const { uniforms } = this.resolve;
    gl.useProgram(this.resolve.made);
    this.bind([[this.sums[0], uniforms.sumNormal], [this.sums[1], uniforms.sumColor], [this.sums[2], uniforms.sumPoint]]);
    gl.uniform1i(uniforms.supersampling, this.supersampling);
    gl.uniform2fv(uniforms.size, this.size);
    gl.uniform1f(uniforms.focal, camera.focal);
    gl.uniform4fv(uniforms.surfaces, surfacesOf(this.scene.bodies[0]));
    gl.uniform3fv(uniforms.top, this.scene.background[0]);
    gl.uniform3fv(uniforms.bottom, this.scene.background[1]);
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    this.drawTools(camera, tools);
    gl.bindVertexArray(null);
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
    this.bind([[this.seen, uniforms.seen]]);
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

  /** Depth (m) of tissue at a pixel of the canvas (y down), and its normal (right, up, to the viewer); null for none. */
  pick(x, y) {
    const { gl } = this;
    if (!this.first) {
      return null;
    }
    const at = [Math.floor(x * this.supersampling), Math.floor(this.size[1] - 1 - y * this.supersampling)];
    const read = (framebuffer) => {
      const numbers = new Float32Array(4);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, framebuffer);
      gl.readBuffer(gl.COLOR_ATTACHMENT0);
      gl.readPixels(at[0], at[1], 1, 1, gl.RGBA, gl.FLOAT, numbers);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
      return numbers;
    };
    const near = read(this.first)[0];
    if (!(near > 0)) {
      return null;
    }
    const normal = read(this.second);
    return { depth: 1 / near, normal: [normal[0], normal[1], normal[2]] };
  }
}

function surfacesOf(info) {
  const numbers = new Float32Array(16);
  info.surfaces.slice(0, 4).forEach((surface, k) => numbers.set(surface, 4 * k));
  return numbers;
}
