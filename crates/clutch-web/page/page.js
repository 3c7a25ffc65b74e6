const LAWS = DECLARED.laws; // [{name, title, scenario}]
const PARAMETERS = DECLARED.parameters; // key → what the tables say of it
const LESSON = [
  { title: "PD sticks", laws: ["pd"], set: {},
    says: "At 2 °/s the shaft under PD stops and breaks away some forty times a second: flat stairs, and a voltage that saws." },
  { title: "Sliding mode sticks less", laws: ["pd", "smc"], set: {},
    says: "Sliding mode (SMC) slips through most of it, and pays: its largest error is nearly four times PD’s. Thin the boundary layer, and the sticks come back." },
  { title: "Glide does not", laws: ["pd", "smc", "glide"], set: {},
    says: "Glide times the encoder’s edges, learns friction from them and inverts it: no stick, less than a seventh of PD’s largest error, a quiet voltage." },
  { title: "Slower: 1 °/s", laws: ["pid", "glide"], set: { "reference.ramp.rate_deg_s": "1" },
    says: "At 2 °/s PID does not stick either. Half as fast it stops and breaks away some nine times a second: its integral fills through each stop. Glide goes on." },
  { title: "A wrong belief", laws: ["glide"], set: { "model.friction.stribeck.mu_static": "0.07", "model.friction.stribeck.mu_dynamic": "0.05" },
    says: "Glide believes half of the friction that there is, and hardly minds: it learns. A wrong delay is another matter: raise the rig’s to 3 periods, then what glide believes of it." },
  { title: "Faster: 20 °/s", laws: ["pd", "smc", "glide"], set: { "reference.ramp.rate_deg_s": "20" },
    says: "At 20 °/s nothing sticks: inertia carries the shaft over the friction. Slow down, and see which law sticks first." },
];
const FIGURES = ["stick_slip_cycles_per_s", "stick_time_fraction", "max_error_rad", "rms_error_rad", "control_variation_v_s"];

const at = (id) => document.getElementById(id);
const make = (tag, attributes = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), attributes);
  element.append(...children);
  return element;
};
const digits = (x) => String(Number(x.toPrecision(3)));
const shown = (x) => (x === null ? "–" : Math.abs(x) >= 100 ? String(Math.round(x)) : digits(x)).replace("-", "−");

// ---- settings: values by key, as text; what is not there is as the scenario has it.
let laws = new Set(LESSON[2].laws);
let set = {};

const lawOf = (key) => (key.startsWith("law.") ? key.split(".")[1] : null);
const setOf = (law) => Object.entries(set).filter(([key]) => [null, law.name].includes(lawOf(key)));
const shared = () => Object.keys(set).every((key) => lawOf(key) === null);
const active = () => LAWS.filter((law) => laws.has(law.name));

function command() {
  const quoted = (text) => (/^[\w.+-]*$/.test(text) ? text : `'${text.replaceAll("'", "'\\''")}'`);
  const sets = (pairs) => pairs.map(([key, value]) => ` --set ${quoted(key)}=${quoted(value)}`).join("");
  const those = active();
  if (those.length > 1 && shared()) return `clutch compare ${those.map((law) => law.scenario).join(" ")}${sets(Object.entries(set))}`;
  return those.map((law) => `clutch sim ${law.scenario}${sets(setOf(law))}`).join("\n");
}

function toFragment() {
  const fields = new URLSearchParams({ laws: [...laws].join(","), ...set });
  history.replaceState(null, "", `#${fields}`);
}

function fromFragment() {
  const fields = new URLSearchParams(location.hash.slice(1));
  if (!fields.has("laws")) return;
  const names = fields.get("laws").split(",");
  laws = new Set(LAWS.map((law) => law.name).filter((name) => names.includes(name)));
  fields.delete("laws");
  set = Object.fromEntries(fields); // an unknown key is answered by the simulator
}

// ---- sliders
const MIDDLE = 100;
/** A slider's scale: decades around the scenario's value, whole numbers one by one; 0 at its left end where that is allowed. */
function scale(row) {
  const low = row.minimum ?? -Infinity, high = row.maximum ?? Infinity;
  if (row.type === "integer") {
    const most = Math.min(high, Math.max(10, 10 * row.value));
    return { most: most - low, value: (place) => String(low + place), place: (value) => value - low };
  }
  const zero = row.minimum === 0;
  return {
    most: 2 * MIDDLE,
    value: (place) => zero && place <= 0 ? "0" : digits(Math.min(high, row.value * 10 ** ((place - MIDDLE) / MIDDLE))),
    place: (value) => value > 0 ? MIDDLE * (1 + Math.log10(value / row.value)) : 0,
  };
}

const sliders = new Map();
function addSlider(group, key) {
  const row = PARAMETERS[key], { most, value, place } = scale(row), id = key.replaceAll(".", "-");
  // The tables' text up to the first break: "Proportional gain of (4)."
  const name = row.description.split(/[.,:] |`/)[0].replace(/[.,]$/, "").replace(/,? (of|in)? ?\(\d+\)/g, "");
  const label = make("label", { htmlFor: id, title: row.description }, name, make("code", { textContent: key }));
  const range = make("input", { type: "range", id, min: 0, max: most, step: 1 });
  const text = make("input", { type: "text", inputMode: "decimal", autocomplete: "off" });
  text.setAttribute("aria-label", `${name}, ${row["x-unit"] ?? "no unit"}`);
  const box = make("div", { className: "slider" }, label, range, text, make("span", { textContent: row["x-unit"] ?? "" }));
  const take = (entered) => {
    if (entered === "" || Number(entered) === row.value) delete set[key];
    else set[key] = entered;
    changed();
  };
  range.addEventListener("input", () => take(value(range.valueAsNumber)));
  text.addEventListener("change", () => take(text.value.trim().replace(",", ".")));
  sliders.set(key, () => {
    const now = set[key] ?? String(row.value);
    range.value = Math.round(place(Number(now)));
    range.setAttribute("aria-valuetext", `${now} ${row["x-unit"] ?? ""}`);
    if (document.activeElement !== text || !(key in set)) text.value = now;
    box.classList.toggle("changed", key in set);
  });
  group.append(box);
}

function show() {
  sliders.forEach((update) => update());
  const others = Object.entries(set).filter(([key]) => !sliders.has(key));
  if (document.activeElement !== at("other")) at("other").value = others.map((pair) => pair.join("=")).join("\n");
  LAWS.forEach(({ name }) => (at(`law-${name}`).checked = laws.has(name)));
  LESSON.forEach((step, i) => {
    const here = JSON.stringify([step.set, step.laws]) === JSON.stringify([set, active().map((law) => law.name)]);
    at("steps").children[i].firstChild.setAttribute("aria-pressed", here);
    if (here) at("sentence").textContent = step.says;
  });
  showStep();
  // A line ends before a setting, not within.
  const parts = (line) => line.split(/(?= --set )/).map((part) => make("span", { textContent: part }));
  at("command").replaceChildren(...command().split("\n").flatMap((line, i) => [i > 0 ? "\n" : "", ...parts(line)]));
}

/** The step that is pressed goes to the middle of the row, which is wider than a phone. */
function showStep() {
  const middle = (element) => element.getBoundingClientRect().left + element.getBoundingClientRect().width / 2;
  const pressed = at("steps").querySelector("[aria-pressed=true]");
  if (pressed) at("steps").scrollLeft += middle(pressed) - middle(at("steps"));
}

// ---- questions: one at a time, the latest first
let worker, busy = true, waiting = null, asked = null, answer = null;

function changed() {
  toFragment();
  show();
  waiting = performance.now();
  ask();
}

function ask() {
  if (busy || waiting === null) return;
  asked = { at: waiting, laws: active() };
  [waiting, busy] = [null, true];
  const runs = asked.laws.map((law) => [law.scenario, setOf(law)]);
  worker.postMessage({ question: `runs = ${JSON.stringify(runs)}` });
}

function start() {
  const code = new Blob([at("worker").textContent], { type: "text/javascript" });
  worker = new Worker(URL.createObjectURL(code));
  worker.onerror = (event) => say(`The simulator could not be started: ${event.message}`);
  let ready = false;
  worker.onmessage = ({ data }) => {
    busy = false;
    if (data.broken) {
      say(`The simulator stopped: ${data.broken}`);
      worker.terminate();
      busy = true;
      // One that never answered would break again, for ever.
      return ready ? start() : undefined;
    }
    ready = true;
    if (data.answer) {
      // Drawn also where another is waiting: whoever drags a slider sees the way.
      answer = { laws: asked.laws, ...JSON.parse(data.answer) };
      draw();
      const step = performance.now() - asked.at;
      Object.assign(document.body.dataset, { answers: Number(document.body.dataset.answers ?? 0) + 1, step, took: data.took_ms, memory: data.memory });
      at("status").textContent = `Simulated and drawn in ${Math.round(step)} ms; memory of the simulator ${(data.memory / 2 ** 20).toFixed(1)} MiB.`;
    }
    ask();
  };
  worker.postMessage({ module: bytes() });
}

/** The module: byte b stands as the letter U+00b, and where a page may not have that letter, as another. */
function bytes() {
  const text = at("module").textContent, places = {{places}};
  const module = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) {
    const letter = text.charCodeAt(i);
    module[i] = places[letter] ?? letter;
  }
  return module;
}

function say(text) {
  at("wrong").hidden = !text;
  at("wrong").textContent = text;
}

// ---- pictures
const SVG = "http://www.w3.org/2000/svg";
const svg = (tag, attributes, text) => {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  if (text !== undefined) element.textContent = text;
  return element;
};

function ticks(low, high, about) {
  const rough = (high - low) / about, power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((n) => n * power >= rough);
  const list = [];
  for (let i = Math.ceil(low / step - 1e-9); i <= high / step + 1e-9; i++) list.push(i * step);
  return { list, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

/** Curves over time. Each: {colour, x, y, step, dashed}, or {colour, x, low, high} for a band. `strips`: times at rest of each law. */
function chart(place, { label, unit, from, to, curves, strips = [], mark }) {
  const width = Math.max(240, at(place).clientWidth), phone = width < 480;
  const height = Math.round(Math.min(phone ? 0.5 * width : 0.62 * width, 290, Math.max(130, 0.26 * innerHeight)));
  const left = 46, right = width - 8, top = 8 + 6 * strips.length, bottom = height - 32;
  const values = curves.flatMap((c) => [c.y, c.low, c.high].flatMap((list) => list ?? [])).filter((y) => y !== null);
  let low = values.reduce((a, b) => Math.min(a, b), Infinity), high = values.reduce((a, b) => Math.max(a, b), -Infinity);
  if (!(high > low)) [low, high] = Number.isFinite(low) ? [low - 1, high + 1] : [0, 1];
  const margin = 0.04 * (high - low);
  [low, high] = [low - margin, high + margin];
  const px = (t) => left + ((t - from) / (to - from)) * (right - left);
  const py = (y) => bottom - ((y - low) / (high - low)) * (bottom - top);
  const f = (x) => x.toFixed(1);
  const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, height, role: "img", "aria-label": label });
  const line = (x1, y1, x2, y2, colour) => root.append(svg("line", { x1: f(x1), y1: f(y1), x2: f(x2), y2: f(y2), stroke: colour }));
  if (mark) root.append(svg("rect", { x: f(px(mark[0])), y: top, width: f(Math.max(2, px(mark[1]) - px(mark[0]))), height: bottom - top, fill: "var(--mark)" }));
  const ys = ticks(low, high, (bottom - top) / 36), xs = ticks(from, to, (right - left) / 80);
  for (const y of ys.list) {
    line(left, py(y), right, py(y), Math.abs(y) < 1e-12 ? "var(--zero)" : "var(--grid)");
    root.append(svg("text", { x: left - 5, y: f(py(y) + 4), "text-anchor": "end" }, y.toFixed(ys.decimals).replace("-", "−")));
  }
  for (const x of xs.list) {
    line(px(x), top, px(x), bottom, "var(--grid)");
    root.append(svg("text", { x: f(px(x)), y: bottom + 14, "text-anchor": "middle" }, x.toFixed(xs.decimals)));
  }
  root.append(svg("text", { x: right, y: height - 4, "text-anchor": "end" }, "time (s)"));
  root.append(svg("text", { x: left, y: height - 4 }, unit));
  strips.forEach(({ colour, rests }, i) => {
    for (const [a, b] of rests) root.append(svg("rect", { x: f(px(a)), y: 3 + 6 * i, width: f(Math.max(1, px(b) - px(a))), height: 4, fill: colour }));
  });
  for (const c of curves) {
    const points = (list) => list.map((y, i) => [px(c.x[i]), y === null ? null : py(y)]).filter(([, y]) => y !== null);
    if (c.low) {
      const path = [...points(c.high), ...points(c.low).reverse()].map(([x, y]) => `${f(x)},${f(y)}`);
      root.append(svg("polygon", { points: path.join(" "), fill: c.colour, opacity: 0.22 }));
    }
    if (!c.y) continue;
    const way = points(c.y).map(([x, y], i) => (i === 0 ? `M${f(x)},${f(y)}` : c.step ? `H${f(x)}V${f(y)}` : `L${f(x)},${f(y)}`));
    root.append(svg("path", { d: way.join(""), fill: "none", stroke: c.colour, "stroke-width": c.dashed ? 1.2 : 1.8, "stroke-dasharray": c.dashed ? "5 4" : "none", "stroke-linejoin": "round" }));
  }
  const cursor = svg("g", {});
  root.append(cursor);
  at(place).replaceChildren(root);
  /** Shows where the curves are at a time: a line, and a dot on each. */
  return (t) => {
    const dots = curves.filter((c) => !c.dashed).map((c) => {
      const i = Math.max(0, c.x.findLastIndex((x) => x <= t));
      return svg("circle", { cx: f(px(t)), cy: f(py(c.y[i])), r: 4.5, fill: c.colour, stroke: "var(--paper)" });
    });
    cursor.replaceChildren(svg("line", { x1: f(px(t)), x2: f(px(t)), y1: top, y2: bottom, stroke: "var(--quiet)" }), ...dots);
  };
}

// ---- slow motion: the window's time goes by so many times more slowly than in truth.
const SLOWER = 50;
let cursors = [], playing = null;

function play() {
  if (playing === null || !answer) return;
  const { from_s, to_s } = answer.window ?? { from_s: 0, to_s: 0 }, length = SLOWER * (to_s - from_s);
  const now = performance.now() / 1e3;
  const t = from_s + (length > 0 ? ((now - playing) % length) / SLOWER : 0);
  cursors.forEach((show) => show(t));
  requestAnimationFrame(play);
}

function draw() {
  if (!answer) return;
  if (answer.error) {
    cursors = [];
    return say(answer.error);
  }
  const all = answer.laws.map((law, i) => ({ ...law, ...answer.runs[i], colour: `var(--${law.name})` }));
  const wrong = all.filter((run) => run.error), runs = all.filter((run) => !run.error), window = answer.window;
  // The same words of several laws are said once.
  const words = [...new Set(wrong.map((run) => run.error.replace(`${run.scenario}: `, "")))];
  say(words.map((text) => `${wrong.filter((run) => run.error.endsWith(text)).map((run) => run.title).join(", ")}: ${text}`).join("\n"));
  if (all.length === 0) say("No law is switched on: tick one above.");
  at("figures").replaceChildren(...FIGURES.map((field) => {
    const { label, unit, factor, meaning } = DECLARED.figures[field];
    const cells = LAWS.map((law) => {
      const run = runs.find((r) => r.name === law.name);
      const value = run?.metrics[field];
      return make("td", { textContent: value === undefined ? "" : shown(value === null ? null : value * factor) });
    });
    return make("tr", {}, make("th", { scope: "row", title: meaning }, `${label} `, make("small", { textContent: unit })), ...cells);
  }));
  if (!window) {
    cursors = [];
    return ["position", "error", "velocity", "voltage"].forEach((place) => at(place).replaceChildren());
  }
  at("position-title").textContent = `${Math.round(1e3 * (window.to_s - window.from_s))} ms ${window.words}; strips on top: at rest; dashed: the path`;
  const strips = runs.map((run) => ({ colour: run.colour, rests: run.window.rests_s }));
  const close = (y, path, step) => [
    ...runs.map((run) => ({ colour: run.colour, x: run.window.time_s, y: run.window[y], step })),
    { colour: "var(--ink)", x: runs[0].window.time_s, y: runs[0].window[path], dashed: true },
  ];
  const spoken = (what) => `${what}: ${runs.map((run) => `${run.title}, ${run.window.rests_s.length} sticks in the window`).join("; ")}`;
  const span = { from: window.from_s, to: window.to_s, strips };
  const position = chart("position", { ...span, unit: "encoder (counts)", label: spoken("Position"), curves: close("counts", "path_counts", true) });
  const velocity = chart("velocity", { ...span, unit: "velocity (°/s)", label: spoken("Velocity"), curves: close("velocity_deg_s", "path_velocity_deg_s", false) });
  cursors = [position, velocity];
  const whole = (field) => ({
    from: 0, to: Math.max(...runs.map((run) => run[field].time_s.at(-1))), mark: [window.from_s, window.to_s],
    curves: runs.map((run) => ({ colour: run.colour, x: run[field].time_s, low: run[field].low, high: run[field].high, y: run[field].mean })),
  });
  const extent = (field, unit) => `${unit}: ${runs.map((run) => `${run.title}, ${shown(Math.min(...run[field].low))} to ${shown(Math.max(...run[field].high))}`).join("; ")}`;
  chart("error", { ...whole("error_deg"), unit: "error (°)", label: extent("error_deg", "Error in °") });
  chart("voltage", { ...whole("voltage_v"), unit: "voltage (V)", label: extent("voltage_v", "Voltage in V") });
}

// ---- the page
for (const [i, step] of LESSON.entries()) {
  const button = make("button", { type: "button", textContent: `${i + 1} ${step.title}` });
  button.addEventListener("click", () => {
    [laws, set] = [new Set(step.laws), { ...step.set }];
    changed();
  });
  at("steps").append(make("li", {}, button));
}
for (const law of LAWS) {
  const box = make("input", { type: "checkbox", id: `law-${law.name}` });
  box.style.accentColor = `var(--${law.name})`;
  box.addEventListener("change", () => {
    laws = new Set(LAWS.map((l) => l.name).filter((name) => at(`law-${name}`).checked));
    changed();
  });
  const label = make("label", {}, box, make("span", { textContent: law.title }));
  label.lastChild.style.borderColor = `var(--${law.name})`;
  at("laws").append(make("th", { scope: "col" }, label));
}
for (const { title, law, keys } of DECLARED.groups) {
  const group = make("fieldset", {}, make("legend", {}, title));
  if (law) group.firstChild.prepend(Object.assign(make("i"), { style: `background: var(--${law})` }));
  keys.forEach((key) => addSlider(group, key));
  at("groups").append(group);
}
at("reset").addEventListener("click", () => {
  set = {};
  changed();
});
at("play").addEventListener("click", () => {
  playing = playing === null ? performance.now() / 1e3 : null;
  at("play").setAttribute("aria-pressed", playing !== null);
  at("play").textContent = playing === null ? "Slow motion" : "Stop";
  if (playing === null) draw();
  else play();
});
at("disc").addEventListener("click", () => {
  set["run.seed"] = String(Number(set["run.seed"] ?? 1) + 1);
  changed();
});
at("other").addEventListener("change", () => {
  for (const key of Object.keys(set)) if (!sliders.has(key)) delete set[key];
  for (const entry of at("other").value.split("\n").filter((text) => text.trim())) {
    const [key, ...value] = entry.split("=");
    set[key.trim()] = value.join("=").trim();
  }
  changed();
});
async function copy(text, what) {
  try {
    await navigator.clipboard.writeText(text);
    at("copied").textContent = `${what} copied`;
  } catch {
    at("copied").textContent = `The browser does not let a page copy here; ${what.toLowerCase()}: ${text}`;
  }
}
at("copy").addEventListener("click", () => copy(command(), "Command"));
at("link").addEventListener("click", () => {
  toFragment();
  copy(location.href, "Link");
});
addEventListener("hashchange", () => {
  fromFragment();
  changed();
});
let width = innerWidth;
addEventListener("resize", () => {
  if (innerWidth !== width && answer) draw();
  width = innerWidth;
  showStep();
});
fromFragment();
changed();
start();
