// The stage: what the server sends is drawn, what a user does is sent.
import { Camera, add, dot, length, scale, sub } from "./camera.js";
import { Hands } from "./hands.js";
import { Link } from "./link.js";
import { Pad } from "./pad.js";
import { Panel } from "./panel.js";
import { Past } from "./past.js";
import { Kind, encodeMesh } from "./protocol.js";
import { Quality } from "./quality.js";
import { Renderer } from "./renderer.js";
import { Tools } from "./tools.js";

const PIECE = 256 * 1024;
const MESHES = ["obj", "stl", "ply", "off", "vtk", "msh"];

class Stage {
  constructor() {
    this.canvas = document.getElementById("view");
    this.renderer = new Renderer(this.canvas);
    this.camera = new Camera();
    this.scene = null;
    this.state = null;
    this.unseen = null;
    this.time = 0;
    this.stepSize = 0;
    this.frames = 0;
    /** Pictures that the card was told to draw: their fences, and when (ms) the hand moved that they show. */
    this.ordered = [];
    this.dirty = false;
    this.link = new Link({
      lost: (text) => {
        this.hands.active = null;
        this.panel.curtain(text);
      },
      closed: (text) => this.panel.curtain(text),
      told: (told) => this.told(told),
      message: (message) => this.message(message),
    });
    this.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.panel.curtain("The graphics card is gone. Getting it back …");
    });
    // The session is the server's: this page only looks at it.
    this.canvas.addEventListener("webglcontextrestored", () => location.reload());
    this.past = new Past();
    this.hands = new Hands(this);
    this.pad = new Pad(this);
    this.panel = new Panel(this);
    const software = this.renderer.isSoftware;
    this.quality = new Quality(software);
    document.documentElement.classList.toggle("plain", software);
    addEventListener("resize", () => this.touch());
    document.addEventListener("visibilitychange", () => this.watch());
    // Another address pasted into this tab is another session.
    addEventListener("hashchange", () => location.reload());
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => this.dropped(event));
    this.frame = this.frame.bind(this);
    requestAnimationFrame(this.frame);
    this.link.open();
  }

  /** Diagonal (m) of the bodies. */
  get size() {
    return this.scene ? length(sub(this.scene.high, this.scene.low)) : 1;
  }

  get height() {
    return this.canvas.clientHeight;
  }

  get probeRadius() {
    const tool = this.scene.tools[this.hands.tool];
    return tool.radius || 0.5 * tool.points[0][2];
  }

  /** Something is to be drawn again. */
  touch() {
    this.dirty = true;
  }

  /** Makes the picture as large as the window, with so many samples to a side of a pixel. */
  fit(samples) {
    const ratio = Math.min(window.devicePixelRatio || 1, 2) * Math.min(samples, 1);
    const { canvas } = this;
    const size = [canvas.clientWidth, canvas.clientHeight].map((length) => Math.max(1, Math.round(length * ratio)));
    this.renderer.supersampling = Math.max(samples, 1);
    this.renderer.coarse = samples >= 1 ? 0 : samples < 0.6 ? 2 : 1;
    if (canvas.width !== size[0] || canvas.height !== size[1]) {
      [canvas.width, canvas.height] = size;
    }
  }

  /** Colours the surface by something, which the server sends where it must. */
  color(by) {
    this.renderer.coloring = by;
    this.link.ask({ do: "color", by });
    this.state && this.renderer.setValues(this.state);
    this.touch();
  }

  /** Time stands while all pages are hidden. */
  watch() {
    this.link.ask({ do: "watch", watching: !document.hidden });
    this.touch();
  }

  told(told) {
    switch (told.type) {
      case "hello":
        this.watch();
        this.link.ask({ do: "color", by: this.renderer.coloring });
        break;
      case "scene":
        this.begin(told);
        break;
      case "stats":
        this.panel.stats(told);
        break;
      case "note":
        this.panel.note(told.text, told.bad);
        told.bad && this.panel.curtain(null);
        break;
      case "saved":
        this.panel.note(`Saved in ${told.folder}: ${told.files.join(", ")}`);
        break;
      case "invite":
        this.panel.note("One more page or device, a second hand: ", false, told.url);
        break;
    }
  }

  begin(scene) {
    const same = this.scene?.name === scene.name;
    this.scene = scene;
    this.state = null;
    this.unseen = null;
    this.hands.active = null;
    this.pad.forget();
    this.past.clear(scene.length);
    this.renderer.setScene(scene);
    this.tools = new Tools(this.renderer.gl, scene);
    if (!same) {
      this.home();
      this.panel.choose(scene.hand);
    }
    this.panel.scene(scene);
    this.touch();
  }

  /** Shows the bodies whole between the panels, as the scene does or from another side (degrees, zoom). */
  home(view = this.scene.view) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const [modes, panel] = ["modes", "panel"].map((id) => document.getElementById(id).getBoundingClientRect());
    const [left, right] = panel.width > 0 ? [modes.right, panel.left] : [0, width];
    this.camera.frame(this.scene.low, this.scene.high, view, Math.max(0.3, (right - left) / height));
    // Bodies turn about the middle of the picture, unless there is no room for them.
    width < 1100 && this.camera.pan((0.5 * (left + right - width)) / height, 0);
    this.touch();
  }

  message(message) {
    if (message.epoch !== this.scene?.epoch) {
      return;
    }
    const body = this.renderer.bodies[message.body];
    switch (message.kind) {
      case Kind.NODES:
        this.renderer.addNodes(message);
        break;
      case Kind.SKIN:
        body?.skin(message);
        break;
      case Kind.CLIPS:
        body?.clip(message);
        break;
      case Kind.STATE:
        this.newest = message;
        this.unseen = message;
        this.past.keep(message);
        this.past.shown || this.show(message);
        this.past.length > 0 && !this.past.shown && this.panel.past(this.past.share);
        if (document.hidden) {
          // Nothing is drawn, and nobody shall wait.
          this.link.acknowledge(message);
          this.unseen = null;
        }
        break;
      case Kind.FORCE:
        this.panel.forces(message);
        break;
    }
    this.touch();
  }

  /** Shows a state: the newest, or an earlier one. */
  show(state) {
    this.state = state;
    this.time = state.time;
    this.stepSize = state.stepSize;
    state.bodies.forEach((moved, k) => this.renderer.bodies[k]?.move(moved));
    this.renderer.setValues(state);
    this.touch();
  }

  /** Shows what was at a fraction of the time, while time stands; 1 for what is. Of a recording what was not played yet is played at once. */
  lookBack(share) {
    const left = this.past.timeOf(share) - (this.newest?.time ?? Infinity);
    if (this.past.length > 0 && left > 0) {
      this.link.ask({ do: "step", steps: Math.ceil(left / this.stepSize) });
    }
    if (share < this.past.now && this.panel.playing) {
      this.link.ask({ do: "pause" });
    }
    this.hands.cancel();
    this.past.look(share);
    this.showPast();
  }

  /** Shows the state that is looked at again, or the newest. */
  showPast() {
    const state = this.past.shown ?? this.newest;
    state && this.show(state);
    this.panel.past(this.past.share, state && this.past.shown && state.time - this.newest.time);
  }

  frame(now) {
    requestAnimationFrame(this.frame);
    if (!this.scene || document.hidden || this.renderer.gl.isContextLost()) {
      return;
    }
    this.finished();
    this.pad.poll(now);
    this.past.goOn(now) && this.showPast();
    if (this.ordered.length > 0) {
      // A picture that waited for others would show what was.
      return;
    }
    const samples = this.quality.samples(now, this.dirty);
    if (samples === null) {
      return;
    }
    this.dirty = false;
    this.fit(samples);
    try {
      this.renderer.draw(this.camera, this.drawnTools());
    } catch (error) {
      this.panel.curtain(error.message);
      return;
    }
    this.panel.view(this.camera, this.height);
    this.frames += 1;
    const { unseen } = this;
    this.unseen = null;
    if (unseen) {
      const force = Math.max(length(unseen.grip), ...unseen.tools.map((tool) => length(tool.force)));
      this.panel.now(force);
      this.link.acknowledge(unseen);
    }
    this.ordered.push([this.renderer.fence(), unseen && this.link.stampOf(unseen)]);
  }

  /** Counts the pictures that the card has finished: until then nobody sees them. */
  finished() {
    while (this.ordered.length > 0 && this.renderer.isDone(this.ordered[0][0])) {
      this.panel.drawn(this.ordered.shift()[1]);
    }
  }

  drawnTools() {
    const { state, hands } = this;
    const tools = hands.drawn();
    (state?.tools ?? []).forEach((tool, index) => {
      // Laid aside: far away.
      if (length(sub(tool.position, this.camera.target)) < 10 * this.size) {
        tools.push(this.tools.at(index, tool.position, tool.rotation));
      }
    });
    const { active } = hands;
    const line = active?.mode === "through" ? [...active.start, ...active.last] : hands.marked && [...hands.marked, ...(hands.cross ?? hands.marked)];
    const drawn = line || [-1, -1, -1, -1];
    ["x1", "y1", "x2", "y2"].forEach((name, k) => document.getElementById("line").setAttribute(name, drawn[k]));
    return tools;
  }

  /** Place of a pixel in heights from the middle of the picture. */
  place([x, y]) {
    const { canvas } = this;
    return [(x - 0.5 * canvas.clientWidth) / canvas.clientHeight, (y - 0.5 * canvas.clientHeight) / canvas.clientHeight];
  }

  ray(at) {
    return this.camera.ray(...this.place(at));
  }

  point(at, depth) {
    return this.camera.point(...this.place(at), depth);
  }

  /** Depths (m) along the view between which all bodies lie. */
  depths() {
    const { forward } = this.camera.axes();
    const middle = dot(sub(scale(add(this.scene.low, this.scene.high), 0.5), this.camera.eye), forward);
    return [Math.max(middle - 0.75 * this.size, 0.05 * this.size), middle + 0.75 * this.size];
  }

  /** The point of the plane through \`through\` that faces the viewer, under a pixel. */
  onPlane(at, through) {
    const { forward } = this.camera.axes();
    return this.point(at, dot(sub(through, this.camera.eye), forward));
  }

  /** Surface under a pixel: depth, point and outward normal in the world; null for none. */
  surface(x, y) {
    const found = this.scene && this.renderer.pick(this.camera.eye, this.ray([x, y]));
    return found && { ...found, point: this.point([x, y], found.depth) };
  }

  /** Where a probe first touches a surface, and the direction into it. */
  rest(found) {
    return { point: found.point, inward: scale(found.normal, -1) };
  }

  depthChanged(depth) {
    this.panel.depth(depth);
  }

  savePicture() {
    const { camera, canvas } = this;
    this.link.ask({ do: "picture", eye: camera.eye, target: camera.target, up: camera.axes().up, field_of_view: camera.fieldOfView, width: canvas.clientWidth, height: canvas.clientHeight });
  }

  dropped(event) {
    event.preventDefault();
    const file = event.dataTransfer.files[0];
    const extension = file?.name.split(".").pop().toLowerCase();
    if (!MESHES.includes(extension)) {
      this.panel.note(`Drop a mesh file: ${MESHES.join(", ")}.`, true);
      return;
    }
    this.panel.sure(`Show ${file.name}?`, "Show it", () => this.sendMesh(file, extension));
  }

  async sendMesh(file, extension) {
    const content = new Uint8Array(await file.arrayBuffer());
    for (let at = 0; at < content.length; at += PIECE) {
      this.link.send(encodeMesh(content.length, at, extension, content.subarray(at, at + PIECE)));
      this.panel.curtain(`Sending ${file.name} …`, at / content.length);
      while (this.link.waiting > PIECE) {
        await new Promise((done) => setTimeout(done, 20));
      }
    }
    this.panel.curtain(`Filling ${file.name} with nodes …`, null);
  }
}

try {
  window.stage = new Stage();
} catch (error) {
  document.getElementById("curtain-text").textContent = error.message;
}
