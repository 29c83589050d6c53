"use strict";
// All that the page asks goes through this function, so that it can be answered without a server, too.
async function ask(name, args) {
  const reply = await fetch(`ask/${name}`, {
    method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(args),
  }).catch(() => { throw Object.assign(new Error("tachometry explore has ended: start it again, and open its new address"), { field: "" }); });
  const json = reply.headers.get("content-type").startsWith("application/json");
  const found = json ? await reply.json() : { error: (await reply.text()).trim(), field: "" };
  if ("error" in found) throw Object.assign(new Error(found.error), { field: found.field });
  return found;
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
    input = made("input", { id, type: "text", placeholder: about.default || about.metavar.toLowerCase(), spellcheck: "false", maxlength: 4000 });
    input.value = values[about.name] ?? "";
  }
  input.setAttribute("aria-describedby", told);
  input.addEventListener("input", () => {
    const text = about.flag ? (input.checked === on ? "" : input.checked ? "yes" : "no") : input.value.trim();
    if (text === "" || (about.choices.length && text === about.default)) delete values[about.name];
    else values[about.name] = text;
    changed();
  });
  const default_ = about.default && !about.flag && !about.choices.length ? ` Without it: ${about.default}.` : "";
  return made("div", { class: "field", "data-methods": about.methods.join(" ") },
    made("label", { for: id }, about.name.replaceAll("-", " ")), input,
    made("p", { class: "help", id: `${id}-help` }, about.help + default_),
    made("p", { class: "error", id: `${id}-error`, role: "alert" }));
}

function form() {
  const core = known.groups.filter(group => group.part === "core");
  const first = new Set(known.needed), all = core.flatMap(group => group.options);
  const basics = all.filter(one => first.has(one.name));
  const groups = [["Basics", basics], ...core.map(({ title, options }) => [title, options.filter(one => !first.has(one.name))])];
  for (const [title, options] of groups) {
    if (!options.length) continue;
    const open = title === "Basics" || options.some(one => one.name in values);
    $("form").append(made("details", { class: "group", open }, made("summary", {}, title, made("span", { class: "set" })), ...options.map(field)));
  }
}

// Shows how many options of a group are given, and hides what the method does not have.
function dressed() {
  const method = values.method ?? "auto";
  for (const group of document.querySelectorAll(".group")) {
    const given = [...group.querySelectorAll("[id^=o-]")].filter(one => one.id.slice(2) in values && !one.id.endsWith("-help")).length;
    group.querySelector(".set").textContent = given ? `${given} set` : "";
    const fields = [...group.querySelectorAll(".field")];
    for (const one of fields) one.hidden = method !== "auto" && one.dataset.methods !== "" && !one.dataset.methods.split(" ").includes(method);
    group.hidden = fields.every(one => one.hidden);
  }
  for (const [name] of Object.entries(values)) if ($(`o-${name}`)?.closest(".field").hidden) delete values[name];
}

function wrong(error) {
  for (const one of document.querySelectorAll(".error")) one.textContent = "";
  for (const one of document.querySelectorAll("[aria-invalid]")) one.removeAttribute("aria-invalid");
  if (!error) return;
  const input = error.field && $(`o-${error.field}`);
  (input ? $(`o-${error.field}-error`) : $("error")).textContent = error.message;
  if (!input) return;
  input.setAttribute("aria-invalid", "true");
  input.closest("details").open = true;
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
const cells = (kind, texts, right = []) => made("tr", {}, ...texts.map((text, n) => made(kind, right.includes(n) ? { class: "n" } : {}, text)));

function show(found) {
  $("command").textContent = found.command;
  $("symbol").replaceChildren(symbol(found));
  $("facts").replaceChildren(...listed(found.rows.filter(([name]) => found.facts.includes(name))));
  $("rows").replaceChildren(...listed(found.rows));
  $("ports").replaceChildren(cells("th", ["port", "direction", "bits", "unit of an LSB", "what it is"], [2]),
    ...found.ports.map(p => cells("td", [p.name, p.direction, `${p.width}${p.signed ? " signed" : ""}`, p.unit, p.help], [2])));
}

const refresh = latest(async () => {
  const asked = { ...values };
  try {
    checked = await ask("check", { options: asked });
    wrong(null);
    show(checked);
    $("status").textContent = "";
  } catch (error) {
    checked = null;
    wrong(error);
    $("status").textContent = "An option is not what it must be; what is shown is of the options before.";
  }
  for (const one of document.querySelectorAll("main > section")) one.classList.toggle("stale", !checked);
  $("download").disabled = $("copy").disabled = !checked;
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
    const { name, files, zip } = await ask("files", { options: { ...values } });
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

(async () => {
  known = await ask("options", {});
  const given = [...new URLSearchParams(location.hash.slice(1))];
  Object.assign(values, given.length ? Object.fromEntries(given) : known.start);
  form();
  changed();
})().catch(error => wrong(error));
