// Buttons, sliders, figures and messages.
import { Plot } from "./plot.js";
import { GRIP } from "./protocol.js";
import { COLORINGS } from "./renderer.js";
import { STOPS } from "./shaders.js";

const get = (id) => document.getElementById(id);
const SOFTEST = 500;
const STIFFEST = 100000;
const toModulus = (share) => SOFTEST * (STIFFEST / SOFTEST) ** (share / 100);
const toShare = (modulus) => (100 * Math.log(modulus / SOFTEST)) / Math.log(STIFFEST / SOFTEST);
const kilo = (pascals) => `${(pascals / 1000).toPrecision(2)} kPa`;
const lengthOf = (metres) => (metres < 0.01 ? `${+(1000 * metres).toPrecision(2)} mm` : metres < 1 ? `${+(100 * metres).toPrecision(2)} cm` : `${+metres.toPrecision(2)} m`);
/** Words for people about the body and the tool of this scene. */
const HINTS = {
  cut: (body) => `<b>Drag across the ${body}</b> to cut · <b>right drag</b> turns · <b>wheel</b> zooms · <b>Shift + wheel</b> sets the depth`,
  through: (body) => `<b>Draw a line across the ${body}</b> to slice all the way through · <b>right drag</b> turns`,
  press: (body, tool) => `<b>Hold and drag</b> to press the ${body} with the ${tool} · <b>wheel while pressing</b> goes deeper`,
  grab: (body) => `<b>Drag a patch</b> of the ${body} to pull it · <b>right drag</b> turns`,
  view: () => "<b>Drag</b> turns the view · <b>Shift + drag</b> moves it · <b>wheel</b> zooms",
};
const plain = (name) => name.replace(/[<>&]/g, "");

export class Panel {
  constructor(stage) {
    this.stage = stage;
    this.plot = new Plot(get("plot"));
    this.playing = true;
    this.latencies = [];
    this.frames = [];
    this.force = 0;
    const { link } = stage;
    this.actions = {
      play: () => (stage.past.shown ? stage.past.play(performance.now()) : link.ask({ do: this.playing ? "pause" : "play" })),
      step: () => link.ask({ do: "step", steps: 1 }),
      undo: () => link.ask({ do: "undo" }),
      reset: () => this.sure("Go back to the start?", "Reset", () => link.ask({ do: "reset" })),
      save: ({ shiftKey }) => {
        const name = shiftKey ? prompt("Name of the folder that is saved", stage.scene.name) : "";
        name === null || link.ask({ do: "save", name });
      },
      picture: () => stage.savePicture(),
      home: () => stage.home(),
      x: ({ shiftKey }) => stage.home([shiftKey ? -90 : 90, 0, 1]),
      y: ({ shiftKey }) => stage.home([shiftKey ? 180 : 0, 0, 1]),
      z: ({ shiftKey }) => stage.home([0, shiftKey ? -85 : 85, 1]),
      invite: () => link.ask({ do: "invite" }),
    };
    Object.entries(this.actions).forEach(([id, action]) => get(id).addEventListener("click", action));
    document.querySelectorAll("[data-mode]").forEach((button) => button.addEventListener("click", () => this.choose(button.dataset.mode)));
    document.querySelectorAll("[data-unit]").forEach((button) => button.addEventListener("click", () => this.sure("Build the mesh in another unit?", "Build it", () => {
      this.curtain("Building the mesh …", null);
      link.ask({ do: "unit", metres: +button.dataset.unit });
    })));
    document.querySelectorAll("button").forEach((button) => button.addEventListener("click", (event) => {
      // Who uses a pointer has keys for all of the page.
      event.detail > 0 && button.blur();
    }));
    get("scenes").addEventListener("change", ({ target }) => {
      const { value: name, selectedOptions: [option] } = target;
      target.blur();
      target.value = stage.scene.name;
      this.sure(`Show ${name}?`, "Show it", () => {
        this.curtain("Building the scene …", null);
        link.ask({ do: option.dataset.do ?? "scene", name });
      });
    });
    get("past").addEventListener("input", ({ target }) => stage.lookBack(target.value / target.max));
    get("depth").addEventListener("input", (event) => stage.hands.setDepth(event.target.value / 100));
    const slide = (id, show, key, live) => {
      const input = get(id);
      const value = () => (id === "stiffness" ? toModulus(+input.value) : +input.value);
      input.addEventListener("input", () => {
        get(`${id}-value`).textContent = show(value());
        live && link.ask({ do: "set", [key]: value() });
      });
      let shown = true;
      input.addEventListener("pointerdown", () => (shown = false));
      input.addEventListener("change", () => {
        shown = true;
        const now = value();
        live || this.sure("Build the tissue with another stiffness?", "Build it", () => {
          this.curtain("Building the tissue …", null);
          link.ask({ do: "set", [key]: now });
        });
      });
      return (now) => {
        if (shown) {
          input.value = id === "stiffness" ? toShare(now) : now;
          get(`${id}-value`).textContent = show(now);
        }
      };
    };
    this.sliders = [slide("gravity", (x) => `${x.toFixed(1)} m/s²`, "gravity", true), slide("damping", (x) => `${x.toFixed(1)} 1/s`, "damping", true), slide("stiffness", kilo, "stiffness", false)];
    get("coloring").append(...Object.keys(COLORINGS).map((name) => new Option(name)));
    get("coloring").addEventListener("change", ({ target }) => {
      target.blur();
      stage.color(target.value);
      this.legend();
    });
    get("legend").style.background = `linear-gradient(90deg, ${STOPS.map((stop) => `rgb(${stop.map((x) => 255 * x)})`)})`;
    addEventListener("keydown", (event) => this.key(event));
    this.hint();
  }

  key(event) {
    const { target, key } = event;
    const own = target.matches?.("select") || (target.type === "range" && /^(Arrow|Home|End|Page)/.test(key)) || (target.matches?.("button") && key === " ");
    if (event.repeat || own || get("ask").open) {
      return;
    }
    const control = event.ctrlKey || event.metaKey;
    const modes = { 1: "cut", 2: "through", 3: "press", 4: "grab", 5: "view" };
    const ids = control ? { s: "save", ...(event.shiftKey ? {} : { z: "undo" }) } : { " ": "play", ".": "step", r: "reset", p: "picture", h: "home", x: "x", y: "y", z: "z" };
    const id = ids[key.toLowerCase()];
    if (!control && modes[key]) {
      this.choose(modes[key]);
    } else if (id) {
      event.preventDefault();
      this.actions[id](event);
    }
  }

  /** Does what would take strokes away, after a question where there are any. */
  sure(question, yes, action) {
    const strokes = this.last?.strokes ?? 0;
    if (strokes === 0) {
      action();
      return;
    }
    const dialog = get("ask");
    get("ask-text").textContent = `${question} It takes ${strokes === 1 ? "your stroke" : `your ${strokes} strokes`} away.`;
    const answer = get("ask-yes");
    answer.textContent = yes;
    // A dialog's close event waits for a picture: after slow ones, those of declined questions would act as well.
    answer.onclick = action;
    dialog.showModal();
  }

  choose(mode) {
    document.querySelectorAll("[data-mode]").forEach((button) => button.setAttribute("aria-pressed", button.dataset.mode === mode));
    this.stage.hands.setMode(mode);
    this.hint();
  }

  hint() {
    const hint = get("hint");
    const { scene, hands } = this.stage;
    const [body, tool] = [scene?.bodies.length === 1 && scene.bodies[0].name, scene?.tools[hands.tool]?.name];
    hint.innerHTML = HINTS[hands.mode](plain(body || "surface"), plain(tool || "probe"));
    hint.classList.remove("gone");
    clearTimeout(this.hinting);
    this.hinting = setTimeout(() => hint.classList.add("gone"), 9000);
  }

  scene(scene) {
    const list = get("scenes");
    list.replaceChildren(...scene.scenes.map(([name, summary]) => {
      const option = new Option(name, name, name === scene.name, name === scene.name);
      option.title = summary;
      return option;
    }), ...this.recordings(scene.recordings));
    get("description").textContent = scene.description;
    get("units").hidden = !scene.unit;
    get("units").firstElementChild.textContent = `The mesh is ${lengthOf(Math.max(...scene.high.map((x, k) => x - scene.low[k])))} long. Its numbers are in`;
    document.querySelectorAll("[data-unit]").forEach((button) => button.setAttribute("aria-pressed", Math.abs(button.dataset.unit / scene.unit - 1) < 1e-6));
    this.depth(this.stage.hands.depth);
    this.legend();
    this.hint();
    this.plot.clear();
    this.past(1);
    this.curtain(null);
  }

  /** What can be played again, for the list of scenes. */
  recordings(names) {
    const group = document.createElement("optgroup");
    group.label = "Recordings";
    group.append(...names.map((name) => {
      const option = new Option(name);
      option.dataset.do = "open";
      return option;
    }));
    return names.length ? [group] : [];
  }

  /** The scale of what colours the surface. */
  legend() {
    const { coloring, most } = this.stage.renderer;
    get("legend").hidden = coloring === "tissue";
    const words = { tissue: "", moved: lengthOf(most), strain: `${100 * most} %` }[coloring] ?? `${most / 1000} kPa`;
    get("coloring-most").textContent = words && `0 – ${words}`;
  }

  depth(share) {
    get("depth").value = Math.round(100 * share);
    get("depth-value").textContent = `${(1000 * share * this.stage.size).toFixed(0)} mm`;
  }

  /** Shows where in the time so far the picture is, and how long (s) after now, which is never above zero. */
  past(share, after) {
    get("past").value = share * get("past").max;
    get("past-value").textContent = after ? `${after.toFixed(1)} s` : "now";
  }

  /** Shows how long a length is in the middle of the picture, and where the axes point. */
  view(camera, height) {
    const metre = (camera.focal * height) / camera.distance;
    const power = 10 ** Math.floor(Math.log10(110 / metre));
    const long = power * [5, 2, 1].find((digit) => digit * power * metre <= 110);
    const [bar, words] = get("scale").querySelectorAll("i, span");
    bar.style.width = `${long * metre}px`;
    words.textContent = lengthOf(long);
    const { right, up } = camera.axes();
    get("axes").querySelectorAll("g").forEach((axis, k) => {
      const [, path, letter] = axis.children;
      path.setAttribute("d", `M0 0L${17 * right[k]} ${-17 * up[k]}`);
      letter.setAttribute("transform", `translate(${24 * right[k]} ${-24 * up[k]})`);
    });
  }

  /** Words over everything; none takes them away. `share`: how much is done, null where nobody knows. */
  curtain(text, share) {
    const progress = get("progress");
    progress.hidden = share === undefined;
    share === null || share === undefined ? progress.removeAttribute("value") : (progress.value = share);
    get("curtain").classList.toggle("gone", !text);
    if (text) {
      get("curtain-text").textContent = text;
    }
  }

  note(text, bad = false, url = "") {
    const line = document.createElement("p");
    line.textContent = text;
    if (url) {
      const link = document.createElement("a");
      [link.href, link.target, link.textContent] = [url, "_blank", url];
      line.append(link);
    }
    line.classList.toggle("bad", bad);
    get("notes").append(line);
    setTimeout(() => line.remove(), url ? 60000 : bad ? 9000 : 5000);
  }

  stats(stats) {
    this.playing = stats.playing;
    get("play-icon").setAttribute("d", stats.playing ? "M8 5v14M16 5v14" : "M7 4v16l13-8z");
    get("undo").disabled = stats.undo === 0;
    get("undo-count").textContent = stats.undo || "";
    get("undo").title = `Undo the last stroke: ${stats.undo} of ${stats.strokes} can be undone (Ctrl-Z)`;
    get("play").setAttribute("aria-label", stats.playing ? "Pause" : "Play");
    this.sliders.forEach((show, k) => show(stats.values[k]));
    this.last = stats;
    this.show();
  }

  /** Takes a drawn picture into account, and when (ms) the hand moved that it shows; null for none. */
  drawn(stamp) {
    const now = performance.now();
    this.frames.push(now);
    while (this.frames[0] < now - 1000) {
      this.frames.shift();
    }
    if (stamp !== null) {
      this.latencies.push(now - stamp);
      this.latencies.splice(0, this.latencies.length - 400);
    }
  }

  /** Figure below which a fraction of the latencies lies (ms). */
  latency(share) {
    const sorted = [...this.latencies].sort((a, b) => a - b);
    return sorted.length ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))] : null;
  }

  show() {
    const s = this.last;
    if (!s) {
      return;
    }
    const p95 = this.latency(0.95);
    const pace = s.settling ? "coming to rest" : !s.playing ? "paused" : `${s.replaying ? "recorded, " : ""}${s.real_time.toFixed(2)} ×`;
    const rows = [
      ["Real time", pace, s.playing && !s.settling ? (s.real_time > 0.9 ? "good" : "bad") : ""],
      ["Simulated", `${this.stage.time.toFixed(2)} s`],
      ["Step", `${(1000 * this.stage.stepSize).toFixed(2)} ms in ${s.step_ms.toFixed(2)} ms`],
      ["Nodes · surfels", `${s.nodes} · ${s.surfels}`],
      ["Severed pairs", s.severed],
      ["Strokes", s.strokes],
      ["Frames", `${this.frames.filter((time) => time > performance.now() - 1000).length} /s`],
      ["Hand to picture", p95 === null ? "–" : `${p95.toFixed(0)} ms (p95)`],
      ["Slipped", `${s.slipped.toFixed(1)} s`],
      ["Energy balance", s.balance.toExponential(1), Math.abs(s.balance) < 0.02 ? "good" : "bad"],
      ["Blade path", `${(100 * s.path[0]).toFixed(1)} cm`],
      ["Probe path", `${(100 * s.path[1]).toFixed(1)} cm`],
      ["Peak force", `${s.peak[0].toFixed(2)} · ${s.peak[1].toFixed(2)} N`],
      ...(s.contact === null ? [] : [["Contact of bodies", `${s.contact.toFixed(2)} N`]]),
    ];
    get("figures").replaceChildren(...rows.flatMap(([name, value, kind]) => {
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      dt.textContent = name;
      dd.textContent = value;
      kind && dd.classList.add(kind);
      return [dt, dd];
    }));
  }

  forces({ hand, samples }) {
    if (hand === GRIP || hand === this.stage.hands.tool) {
      this.plot.add(samples);
    }
  }

  now(force) {
    this.force = force;
    get("force").textContent = `${force.toFixed(2)} N`;
    this.plot.draw(this.stage.time);
  }
}
