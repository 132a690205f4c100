// The stage: what the server sends is drawn, what hands do is sent.
import { Camera, add, dot, length, scale, sub, unit } from "./camera.js";
import { Hands } from "./hands.js";
import { Link } from "./link.js";
import { Panel } from "./panel.js";
import { Kind, encodeMesh } from "./protocol.js";
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
    this.dirty = false;
    this.slow = 0;
    this.link = new Link({
      opened: () => {},
      closed: (text) => this.panel.curtain(text),
      told: (told) => this.told(told),
      message: (message) => this.message(message),
    });
    this.hands = new Hands(this);
    this.panel = new Panel(this);
    this.renderer.supersampling = this.renderer.isSoftware ? 1 : 2;
    addEventListener("resize", () => this.resize());
    document.addEventListener("visibilitychange", () => this.touch());
    addEventListener("dragover", (event) => event.preventDefault());
    addEventListener("drop", (event) => this.dropped(event));
    this.resize();
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

  /** Something is to be drawn anew. */
  touch() {
    this.dirty = true;
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const { canvas } = this;
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    this.touch();
  }

  told(told) {
    switch (told.type) {
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
        this.panel.note(`Address for one more client: ${told.url}`);
        break;
    }
  }

  begin(scene) {
    const same = this.scene?.name === scene.name;
    this.scene = scene;
    this.state = null;
    this.unseen = null;
    this.hands.active = null;
    this.renderer.setScene(scene);
    this.tools = new Tools(this.renderer.gl, scene);
    if (!same) {
      this.home();
    }
    this.panel.scene(scene);
    this.touch();
  }

  home() {
    const { scene, canvas } = this;
    // Room for the panels at the sides.
    const aspect = Math.max(0.5, (canvas.clientWidth - (canvas.clientWidth > 820 ? 420 : 0)) / canvas.clientHeight);
    this.camera.frame(scene.low, scene.high, scene.view, aspect);
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
        this.state = message;
        this.unseen = message;
        message.bodies.forEach((moved, k) => this.renderer.bodies[k]?.move(moved));
        this.time = message.time;
        this.stepSize = message.stepSize;
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

  frame() {
    requestAnimationFrame(this.frame);
    if (!this.dirty || !this.scene || document.hidden) {
      return;
    }
    this.dirty = false;
    const begun = performance.now();
    this.renderer.draw(this.camera, this.drawnTools());
    this.frames += 1;
    const { unseen } = this;
    this.unseen = null;
    if (unseen) {
      const force = Math.max(length(unseen.grip), ...unseen.tools.map((tool) => length(tool.force)));
      this.panel.now(force);
      this.panel.drawn(this.link.latency(unseen));
      this.link.acknowledge(unseen);
    }
    this.adapt(performance.now() - begun);
  }

  /** Takes fewer samples where frames take long. */
  adapt(spent) {
    this.slow = 0.9 * this.slow + 0.1 * spent;
    if (this.slow > 25 && this.renderer.supersampling > 1) {
      this.renderer.supersampling = 1;
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
    const drawn = active?.mode === "through" ? [...active.start, ...active.last] : [-1, -1, -1, -1];
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

  /** Surface under a pixel: depth, point and outward normal in the world; null for none. `now`: as it is, not as drawn last. */
  surface(x, y, now = false) {
    if (now && this.dirty && this.scene) {
      this.renderer.draw(this.camera, []);
    }
    const ratio = this.canvas.width / this.canvas.clientWidth;
    const found = this.scene && this.renderer.pick(x * ratio, y * ratio);
    if (!found) {
      return null;
    }
    const { right, up, forward } = this.camera.axes();
    const [a, b, c] = found.normal;
    const normal = unit(add(add(scale(right, a), up, b), forward, -c));
    return { depth: found.depth, point: this.point([x, y], found.depth), normal };
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
    this.link.ask({ do: "picture", eye: camera.eye, target: camera.target, up: camera.axes().up, field_of_view: camera.fieldOfView, width: canvas.width, height: canvas.height });
  }

  async dropped(event) {
    event.preventDefault();
    const file = event.dataTransfer.files[0];
    const extension = file?.name.split(".").pop().toLowerCase();
    if (!MESHES.includes(extension)) {
      this.panel.note(`Drop a mesh file: ${MESHES.join(", ")}.`, true);
      return;
    }
    this.panel.curtain(`Filling ${file.name} with nodes …`);
    const content = new Uint8Array(await file.arrayBuffer());
    for (let at = 0; at < content.length; at += PIECE) {
      this.link.send(encodeMesh(content.length, at, extension, content.subarray(at, at + PIECE)));
    }
  }
}

try {
  window.stage = new Stage();
} catch (error) {
  document.getElementById("curtain-text").textContent = error.message;
}
