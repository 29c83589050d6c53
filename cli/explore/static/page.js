"use strict";
// All that the page asks goes through this function; without a server, `answered` is what answers.
async function ask(name, args) {
  const found = await (window.answered ?? served)(name, args);
  if ("error" in found) throw Object.assign(new Error(found.error), { field: found.field });
  return found;
}

async function served(name, args) {
  const reply = await fetch(`ask/${name}`, {
    method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(args),
  }).catch(() => null);
  if (!reply) return { error: "tachometry explore has ended: start it again, and open its new address", field: "" };
  const json = reply.headers.get("content-type").startsWith("application/json");
  return json ? reply.json() : { error: (await reply.text()).trim(), field: "" };
}

const $ = id => document.getElementById(id);
const made = (tag, about = {}, ...inside) => {
  const one = tag === "svg" || about.svg ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(about)) if (name !== "svg" && value !== false && value != null) one.setAttribute(name, value === true ? "" : value);
  one.append(...inside);
  return one;
};
const values = {};  // texts of options, by their names; what is not given is not there
// Runs what is slow once at a time, and once more if it was asked for meanwhile.
const latest = work => {
  let busy = false, again = false;
  return async () => {
    again = true;
    if (busy) return;
    busy = true;
    while (again) { again = false; await work(); }
    busy = false;
  };
};

let known, checked = null;
// Options of a part of the page, of those that are given.
const part = name => Object.fromEntries(known.groups.filter(group => group.part === name).flatMap(group => group.options)
  .filter(one => one.name in values && one.name !== "motion").map(one => [one.name, values[one.name]]));

// Of these options one is given: the one that was typed last.
const INSTEAD = [["ppr", "lines", "cpr", "pole-pairs"], ["tick", "pwm", "dt"], ["frac-bits", "lsb"]];

function field(about) {
  const id = `o-${about.name}`, told = `${id}-help ${id}-error`;
  const on = about.flag && about.default === about.name;
  let input;
  if (about.choices.length) {
    const empty = about.choices.includes(about.default) ? [] : [made("option", { value: "" }, about.default || "none")];
    input = made("select", { id }, ...empty, ...about.choices.map(one => made("option", { value: one }, one)));
    input.value = values[about.name] ?? (empty.length ? "" : about.default);
  } else if (about.flag) {
    input = made("input", { id, type: "checkbox" });
    input.checked = about.name in values ? values[about.name] === "yes" : on;
  } else {
    input = made("input", { id, type: "text", placeholder: about.default || (about.metavar === "N" ? "number" : about.metavar.toLowerCase()), spellcheck: "false", maxlength: 4000 });
    input.value = values[about.name] ?? "";
  }
  input.setAttribute("aria-describedby", told);
  input.addEventListener("input", () => {
    const text = about.flag ? (input.checked === on ? "" : input.checked ? "yes" : "no") : input.value.trim();
    if (text === "" || (about.choices.length && text === about.default)) delete values[about.name];
    else values[about.name] = text;
    for (const other of text && INSTEAD.find(names => names.includes(about.name)) || []) if (other !== about.name) {
      delete values[other];
      $(`o-${other}`).value = "";
    }
    changed();
  });
  const default_ = about.default && !about.flag && !about.choices.length ? ` Without it: ${about.default}.` : "";
  return made("div", { class: "field", "data-methods": about.methods.join(" ") },
    made("label", { for: id }, about.name.replaceAll("-", " ")), input,
    made("p", { class: "help", id: `${id}-help` }, about.help + default_),
    made("p", { class: "error", id: `${id}-error`, role: "alert" }));
}

const narrow = matchMedia("(max-width: 62rem)");  // as in page.css

function form() {
  const core = known.groups.filter(group => group.part === "core");
  const first = new Set(known.needed), all = core.flatMap(group => group.options);
  const basics = all.filter(one => first.has(one.name));
  const groups = [["Basics", basics], ...core.map(({ title, options }) => [title, options.filter(one => !first.has(one.name))])];
  const more = made("details", { class: "more", open: !narrow.matches || all.some(one => one.name in values && !first.has(one.name)) },
    made("summary", {}, "All options"));
  for (const [title, options] of groups) {
    if (!options.length) continue;
    const open = title === "Basics" || options.some(one => one.name in values);
    (title === "Basics" ? $("form") : more).append(made("details", { class: "group", open }, made("summary", {}, title, made("span", { class: "set" })), ...options.map(field)));
  }
  $("form").append(more);
}

// Shows how many options of a group are given, and hides what the method does not have; of auto what was chosen has it.
function dressed() {
  const method = values.method ?? checked?.method ?? "auto";
  for (const group of document.querySelectorAll(".group, #encoder, #lines")) {
    const given = [...group.querySelectorAll("input, select")].filter(one => one.id.slice(2) in values).length;
    group.querySelector(".set").textContent = given ? ` ${given} set` : "";
    const fields = [...group.querySelectorAll(".field")];
    for (const one of fields) one.hidden = method !== "auto" && one.dataset.methods !== "" && !one.dataset.methods.split(" ").includes(method);
    if (group.className === "group") group.hidden = fields.every(one => one.hidden);
  }
  if (values.method) for (const name of Object.keys(values)) if ($(`o-${name}`)?.closest(".field")?.hidden) delete values[name];
}

function wrong(error, within = "form") {
  for (const one of $(within).querySelectorAll(".error")) one.textContent = "";
  for (const one of $(within).querySelectorAll("[aria-invalid]")) one.removeAttribute("aria-invalid");
  if (!error) return;
  const input = error.field && $(`o-${error.field}`);
  (input ? $(`o-${error.field}-error`) : $({ form: "error", moving: "o-motion-error", live: "live-error" }[within])).textContent = error.message;
  if (!input) return;
  input.setAttribute("aria-invalid", "true");
  if (input.closest("details")) input.closest("details").open = true;
}

function symbol({ module, ports }) {
  const row = 19, top = 40, left = 12, right = 408, middle = 210;
  const side = direction => ports.filter(port => port.direction === direction);
  let y = top;
  const drawn = [], at = (port, y, input) => {
    const x = input ? left + 22 : right - 22, out = input ? left : right, bus = port.width > 1;
    const text = made("text", { svg: 1, x: input ? x + 6 : x - 6, y: y + 4, "text-anchor": input ? "start" : "end" });
    const width = made("tspan", { svg: 1, class: "width" }, bus ? `[${port.width - 1}:0]` : "");
    text.append(port.name, width, made("title", { svg: 1 }, `${port.help} ${port.unit ? `Unit: ${port.unit}.` : ""}`));
    drawn.push(made("line", { svg: 1, class: bus ? "wire bus" : "wire", x1: out, x2: x, y1: y, y2: y }), text);
  };
  for (const port of side("input")) { at(port, y, true); y += row; }
  const inputs = y;
  y = top;
  let by = null;
  for (const port of side("output")) {  // outputs that are new together stand together
    if (by !== null && port.held_by !== by) y += 8;
    by = port.held_by;
    at(port, y, false);
    y += row;
  }
  const height = Math.max(inputs, y) - 2;
  const label = `Symbol of ${module}: inputs ${side("input").map(p => p.name).join(", ")}; outputs ${side("output").map(p => p.name).join(", ")}`;
  return made("svg", { viewBox: `0 0 420 ${height + 12}`, role: "img", "aria-label": label },
    made("rect", { svg: 1, class: "box", x: left + 22, y: 4, width: right - left - 44, height, rx: 5 }),
    made("text", { svg: 1, class: "name", x: middle, y: 22, "text-anchor": "middle" }, module), ...drawn);
}

const listed = rows => rows.flatMap(([name, value]) => [made("dt", {}, name.replaceAll("_", " ")), made("dd", {}, value)]);
const cells = (kind, texts, right = []) => made("tr", {}, ...texts.map((text, n) =>
  made(kind, { class: right.includes(n) && "n", scope: kind === "th" && "col" }, text)));

function show(found) {
  $("command").replaceChildren(...found.command.split(/ (?=-)/).flatMap((words, n) => [n ? " " : "", made("span", {}, words)]));
  $("symbol").replaceChildren(symbol(found));
  $("facts").replaceChildren(...listed(found.rows.filter(([name]) => found.facts.includes(name))));
  $("rows").replaceChildren(...listed(found.rows));
  $("ports").replaceChildren(cells("th", ["port", "direction", "bits", "unit of an LSB", "what it is"], [2]),
    ...found.ports.map(p => cells("td", [p.name, p.direction, `${p.width}${p.signed ? " signed" : ""}`, p.unit, p.help], [2])));
}

// Plots: each is drawn again by its function when the colours of the page change.
const HUES = { s: 225, m: 0, t: 32, mt: 130, rairan: 285, track: 190, hostmot2: 325, odrive: 55 }, drawn = new Map();
const dark = matchMedia("(prefers-color-scheme: dark)");
dark.addEventListener("change", () => { for (const draw of drawn.values()) draw(); });
const hue = name => HUES[name] ?? [...name].reduce((sum, letter) => sum * 31 + letter.charCodeAt(0), 7) % 360;
const named = { true: "var(--ink)", velocity: "var(--accent)", "upper bound": "var(--quiet)", "lower bound": "var(--quiet)" };
const colour = name => named[name] ?? `hsl(${hue(name)} ${name in HUES ? 75 : 45}% ${dark.matches ? 66 : 42}%)`;
const number = value => value == null ? "–" : Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3) ? value.toExponential(1).replace("e+", "e") : String(+value.toPrecision(4));
const seconds = value => value == null ? "–" : value >= 1 || value === 0 ? `${+value.toPrecision(3)} s`
  : value >= 1e-3 ? `${+(value * 1e3).toPrecision(3)} ms` : value >= 1e-6 ? `${+(value * 1e6).toPrecision(3)} µs` : `${+(value * 1e9).toPrecision(3)} ns`;

function plot(id, { title, x, y, logs = false, xs, curves, texts = {}, height = 240, moved, hidden = new Set() }) {
  const draw = () => {
    const place = $(id), probe = document.body.appendChild(made("i"));  // a canvas does not know the names of colours
    const resolved = colour => { probe.style.color = colour; return getComputedStyle(probe).color; };
    const [quiet, grid] = [resolved("var(--quiet)"), resolved("var(--grid)")];
    const whole = (_, all) => all.map(one => !logs || Math.abs(Math.log10(one) % 1) < 1e-9 ? one : null);
    const axis = (label, values) => ({ label, stroke: quiet, grid: { stroke: grid, width: 1, filter: whole }, ticks: { stroke: grid, filter: whole },
      font: "11px system-ui", labelFont: "12px system-ui", size: 34, labelSize: 20, labelGap: 0,
      ...(values ? { values: (_, all) => all.map(one => one == null ? "" : values(one)) } : {}) });
    const inFront = [...curves].sort((a, b) => (a.own ?? 0) - (b.own ?? 0));
    const options = {
      width: place.clientWidth || 600, height, legend: { show: false }, cursor: { y: false, points: { size: 5 } },
      scales: { x: { time: false, distr: logs ? 3 : 1 }, y: { distr: logs ? 3 : 1 } },
      axes: [axis(x, texts.x ?? number), { ...axis(y, texts.y ?? number), size: 60 }],
      series: [{}, ...inFront.map(one => ({ label: one.name, stroke: resolved(colour(one.name)), width: one.own ? 2.5 : 1.25,
        dash: one.rival ? [5, 4] : undefined, show: !hidden.has(one.name), points: { show: false }, spanGaps: false }))],
      hooks: moved ? { setCursor: [u => moved(u.cursor.idx)] } : {},
    };
    probe.remove();
    place.plot?.destroy();
    place.replaceChildren(made("h3", {}, title));
    place.setAttribute("role", "group");
    place.setAttribute("aria-label", `${title}. The table below has the numbers.`);
    place.plot = new uPlot(options, [xs, ...inFront.map(one => one.ys)], place);
    place.plot.names = inFront.map(one => one.name);
  };
  drawn.set(id, draw);
  draw();
}
new ResizeObserver(() => { for (const id of drawn.keys()) $(id).plot.setSize({ width: $(id).clientWidth, height: $(id).plot.height }); }).observe(document.querySelector("main"));

// The table below plots: a row for each curve, with a box that shows and hides it, and what it is at the cursor.
function keyed(id, plots, heads, curves, at, hidden) {
  const rows = curves.map(one => {
    const box = made("input", { type: "checkbox", id: `${id}-${one.name}` }), swatch = made("span", { class: "swatch" });
    swatch.style.borderColor = colour(one.name);
    box.checked = !hidden.has(one.name);
    box.addEventListener("change", () => {
      box.checked ? hidden.delete(one.name) : hidden.add(one.name);
      for (const place of plots) $(place).plot.setSeries($(place).plot.names.indexOf(one.name) + 1, { show: box.checked });
    });
    return made("tr", { class: one.own ? "own" : one.rival ? "rival" : "" }, made("td", {}, made("label", { title: one.what ?? "" }, box, swatch, one.name)),
      ...one.cells.map(cell => made("td", { class: "n" }, cell)), made("td", { class: "n" }));
  });
  $(id).replaceChildren(cells("th", [...heads, at], heads.map((_, n) => n + 1)), ...rows);
  return texts => rows.forEach((row, n) => { row.lastChild.textContent = texts[n]; });
}

const hiddenOver = new Set(), hiddenOn = new Set();
const over = latest(async () => {
  if (!checked) return;
  const { unit, x, heads, curves, left_out } = await ask("curves", { options: part("core") });
  const each = curves.map(one => ({ ...one, what: known.methods[one.name] })), told = keyed("methods", ["errors", "delays"], heads, each, "error at the cursor", hiddenOver);
  const moved = n => told(each.map(one => n == null ? "" : number(one.error[n]))), speed = `speed (${unit})`;
  plot("errors", { title: "Worst error at constant speed, with a real disc", x: speed, y: `error (${unit})`, logs: true, hidden: hiddenOver, xs: x, curves: each.map(one => ({ ...one, ys: one.error })), moved });
  plot("delays", { title: "Delay of the velocity", x: speed, y: "delay", logs: true, hidden: hiddenOver, xs: x, curves: each.map(one => ({ ...one, ys: one.delay })), texts: { y: seconds }, moved });
  $("left-out").textContent = Object.entries(left_out).map(([name, why]) => `${name} is left out: ${why}.`).join(" ");
});

const shownFirst = new Set(["true", "s", "mt", "track", "hostmot2", "odrive"]);
let settled = false;
function responded({ unit, x, true: truth, heads, curves, left_out }) {
  const shown = curves.map(one => ({ ...one, ys: one.velocity }));
  if (truth) shown.unshift({ name: "true", ys: truth, cells: heads.slice(1).map(() => "") });
  if (!settled) for (const one of shown) if (!one.own && !shownFirst.has(one.name)) hiddenOn.add(one.name);
  settled = true;
  const told = keyed("scores", truth ? ["velocity", "deviation"] : ["velocity"], heads, shown, `velocity at the cursor (${unit})`, hiddenOn);
  const moved = n => told(shown.map(one => n == null ? "" : number(one.ys[n])));
  plot("velocity", { title: "Velocity", x: "time", y: `velocity (${unit})`, xs: x, curves: shown, texts: { x: seconds }, moved, hidden: hiddenOn, height: 260 });
  $("deviation").hidden = !truth;
  if (truth) plot("deviation", { title: "Error of the velocity", x: "time", y: `error (${unit})`, xs: x, curves: shown.map(one => ({ ...one, ys: one.ys.map((v, n) => v - truth[n]) })), texts: { x: seconds }, moved, hidden: hiddenOn, height: 200 });
}

let capture = null;  // what is replayed: name and data; null: a motion
const respond = latest(async () => {
  if (!checked || $("moving").hidden) return;
  try {
    responded(capture ? await ask("replay", { options: part("core"), capture: part("capture"), ...capture }) : await ask("respond", { options: part("core"), motion: { motion: $("o-motion").value.trim(), ...part("motion") } }));
    wrong(null, "moving");
    $("encoder").hidden = !!capture;
    $("lines").hidden = $("disc").hidden = !capture;
    $("replayed").textContent = capture ? `${capture.name} is replayed; choose a motion to leave it.` : "or drop its file here: .sr, .csv, .vcd and others";
  } catch (error) { wrong(error, "moving"); }
});

function presets({ motions }) {
  const before = $("preset").value, given = $("o-motion").value;
  $("preset").replaceChildren(...Object.entries(motions).map(([name, motion]) => made("option", { value: motion }, name)), made("option", { value: "" }, "other"));
  const name = before && Object.keys(motions).find(one => one === $("preset").dataset.name);
  if (!before && given) $("preset").value = "";
  else { $("preset").value = motions[name] ?? Object.values(motions)[0]; $("o-motion").value = $("preset").value; }
}
$("preset").addEventListener("change", () => {
  capture = null;
  $("preset").dataset.name = $("preset").selectedOptions[0].textContent;
  if ($("preset").value) $("o-motion").value = $("preset").value;
  delete values.motion;
  respond();
});
$("o-motion").addEventListener("input", () => { capture = null; $("preset").value = ""; values.motion = $("o-motion").value.trim(); changed(); });

async function replay(file) {
  if (!file) return;
  if (file.size > 12e6) return wrong({ message: `${file.name} must have at most 12 MB here: take tachometry replay`, field: "" }, "moving");
  const url = await new Promise(done => { const reader = new FileReader(); reader.onload = () => done(reader.result); reader.readAsDataURL(file); });
  capture = { name: file.name, data: url.slice(url.indexOf(",") + 1) };
  $("preset").value = "";
  $("lines").hidden = false;
  withoutDisc("from a capture of a shaft that coasts down");
  respond();
}
function withoutDisc(text) {
  $("measured-disc").textContent = text;
  $("disc-error").textContent = "";
  $("disc-rows").replaceChildren();
  $("disc-picture").hidden = true;
}
$("calibrate").addEventListener("click", async () => {
  $("calibrate").disabled = true;
  withoutDisc("Measuring the disc…");
  try {
    const { rows, picture, map, reasons } = await ask("calibrate", { options: part("core"), capture: part("capture"), ...capture });
    $("disc-error").textContent = reasons.length ? `The map is refused: ${reasons.join("; ")}.` : "";
    $("disc-rows").replaceChildren(...rows.map(([name, value]) => made("tr", {}, made("th", { scope: "row" }, name), made("td", {}, value))));
    $("disc-picture").src = `data:image/png;base64,${picture}`;
    $("disc-picture").hidden = false;
    $("measured-disc").replaceChildren(...(map ? [made("a", { href: URL.createObjectURL(new Blob([map], { type: "application/json" })), download: "disc.json" }, "disc.json for --disc")] : []));
  } catch (error) {
    withoutDisc("");
    $("disc-error").textContent = error.message;
  }
  $("calibrate").disabled = false;
});
$("file").addEventListener("change", () => { replay($("file").files[0]); $("file").value = ""; });
for (const [kind, on] of [["dragover", true], ["dragleave", false], ["drop", false]]) $("moving").addEventListener(kind, event => {
  event.preventDefault();
  $("moving").classList.toggle("dropping", on);
  if (kind === "drop") replay(event.dataTransfer.files[0]);
});

// Live: the page asks ten times a second for what has come since.
let watching = null;
const sleep = time => new Promise(done => setTimeout(done, time));
async function watch({ session, title, unit, settings }) {
  watching = session;
  $("run").textContent = "Stop";
  $("watched").hidden = false;
  $("now-unit").textContent = unit;
  sliders(session, settings);
  const rows = [], columns = () => [0, 1, 2, 3].map(n => rows.map(row => row[n]));
  plot("running", { title: `Velocity of ${title}`, x: "time of the board", y: `velocity (${unit})`, xs: [], height: 380, texts: { x: seconds },
    curves: [{ name: "upper bound", ys: [], rival: true }, { name: "lower bound", ys: [], rival: true }, { name: "velocity", ys: [], own: true }] });
  while (watching === session) {
    const found = await ask("frames", { session, since: String(rows.at(-1)?.[0] ?? -1) });
    rows.push(...found.rows);
    while (rows.length && rows.at(-1)[0] - rows[0][0] > 10) rows.shift();
    $("told").textContent = found.told;
    if (rows.length) {
      const [times, velocity, lower, upper] = columns();
      $("running").plot.setData([times, upper, lower, velocity]);
      $("now").textContent = number(velocity.at(-1));
      $("measured").replaceChildren(...found.facts.flatMap((facts, of) => facts.filter(([name]) => name !== "speed").flatMap(([name, text]) =>
        [made("dt", {}, name), made("dd", { class: of === 1 && !["0", "-"].includes(text) ? "bad" : "" }, text)])));
    }
    if (found.over) watching = null;
    await sleep(100);
  }
}

function sliders(session, settings) {
  const pending = {}, send = latest(async () => {
    const asked = { ...pending };
    for (const name in asked) delete pending[name];
    if (Object.keys(asked).length) await ask("set", { session, settings: asked }).catch(error => wrong(error, "live"));
  });
  $("sliders").replaceChildren(...settings.map(({ name, least, most, unit, value }) => {
    const shown = made("output", {}, `${number(value)} ${unit}`);
    const input = made("input", { type: "range", min: least, max: most, step: (most - least) / 200, id: `set-${name}`, "aria-describedby": "told" });
    input.value = value;
    input.addEventListener("input", () => { shown.textContent = `${number(+input.value)} ${unit}`; pending[name] = `${input.value}${unit}`; send(); });
    return made("div", { class: "slider" }, made("label", { for: input.id }, name.replace("-", " ")), shown, input);
  }));
}

$("run").addEventListener("click", async () => {
  wrong(null, "live");
  if (watching) { await ask("stop", { session: watching }).catch(() => {}); return; }
  $("run").disabled = true;
  try {
    const started = await ask("start", { options: part("core"), port: $("board").value });
    watch(started).catch(error => { wrong(error, "live"); watching = null; }).finally(() => { if (!watching) $("run").textContent = "Start"; });
  } catch (error) { wrong({ message: error.message, field: "" }, "live"); }
  $("run").disabled = false;
});

async function boards() {
  const { boards } = await ask("boards", {});
  $("board").replaceChildren(...Object.entries(boards).map(([port, title]) => made("option", { value: port }, title)));
  if ("sim:icebreaker" in boards && Object.keys(boards)[0].startsWith("sim:")) $("board").value = "sim:icebreaker";
  $("live").hidden = false;
}

$("measure").addEventListener("click", async () => {
  $("measure").disabled = true;
  $("size").textContent = "Measuring…";
  try {
    const { size, limit } = await ask("size", { options: part("core") });
    $("size").textContent = `${size}; ${limit}`;
  } catch (error) { $("size").textContent = error.message; }
  $("measure").disabled = false;
});

const estimate = latest(async () => {
  if (!checked) return;
  // An option may be wrong since the check, which then comes anew.
  $("size").textContent = (await ask("estimate", { options: part("core") }).catch(() => ({ size: "" }))).size;
});

const refresh = latest(async () => {
  try {
    checked = await ask("check", { options: part("core") });
    wrong(null);
    show(checked);
    dressed();
    presets(checked);
    $("status").textContent = "";
  } catch (error) {
    checked = null;
    wrong(error);
    $("status").textContent = "An option is not what it must be; what is shown is of the options before.";
  }
  for (const one of document.querySelectorAll("main > section")) one.classList.toggle("stale", !checked);
  $("download").disabled = $("copy").disabled = $("measure").disabled = !checked;
  await over();
  await respond();
  await estimate();
});

let timer;
function changed() {
  dressed();
  history.replaceState(null, "", `#${new URLSearchParams(values)}`);
  clearTimeout(timer);
  timer = setTimeout(refresh, 150);
}

$("copy").addEventListener("click", async () => {
  await navigator.clipboard.writeText($("command").textContent);
  $("status").textContent = "The command is copied.";
});

$("download").addEventListener("click", async () => {
  $("status").textContent = "Writing the files…";
  $("download").disabled = true;
  try {
    const { name, files, zip } = await ask("files", { options: part("core") });
    const bytes = Uint8Array.from(atob(zip), letter => letter.charCodeAt(0));
    const link = made("a", { href: URL.createObjectURL(new Blob([bytes], { type: "application/zip" })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    $("status").textContent = `${name} has ${files.length} files.`;
  } catch (error) {
    wrong(error);
    $("status").textContent = "";
  }
  $("download").disabled = !checked;
});

$("form").addEventListener("submit", event => event.preventDefault());
(async () => {
  known = await ask("options", {});
  const given = [...new URLSearchParams(location.hash.slice(1))];
  Object.assign(values, given.length ? Object.fromEntries(given) : known.start);
  const names = new Set(known.groups.flatMap(group => group.options).map(one => one.name));
  const strange = Object.keys(values).filter(name => !names.has(name));
  for (const name of strange) delete values[name];
  form();
  const ofMotion = known.groups.filter(group => group.part === "motion").flatMap(group => group.options).filter(one => one.name !== "motion");
  $("encoder").lastChild.append(...ofMotion.map(field));
  $("lines").lastChild.append(...known.groups.filter(group => group.part === "capture").flatMap(group => group.options).map(field));
  $("lines").hidden = true;
  $("o-motion").value = values.motion ?? "";
  boards().catch(() => {});
  changed();
  $("strange").textContent = strange.length ? `The address has options that are not known, and are left out: ${strange.join(", ")}.` : "";
})().catch(error => wrong(error));
