// The bar above: undo, runs to compare, what to save, progress and the state of the run; below it warnings, answers and the legend.
import { element } from "./element.js";

const BUTTONS = [["undo", "Undo"], ["redo", "Redo"], null, ["pin", "Pin run"], ["unpin", "Unpin"], null, ["theme", "Dark"]];
const EXPORTS = [["case", "Case file"], ["run", "Run (NetCDF)"], ["curves", "Curves (CSV)"], ["picture", "Picture"], ["film", "Film"], ["python", "Copy as Python"]];
const LATE = 200;  // the state of shorter runs does not flicker [ms]

export function bar(root, send, curves) {
  const line = root.querySelector(".sd-bar"), warnings = root.querySelector(".sd-warnings"), by = {};
  let time = 0, dark = matchMedia("(prefers-color-scheme: dark)").matches, now = {}, of = {}, run = 0, words = "reading the case", timer = 0;
  const button = (id, words, onclick, disabled = false) => by[id] = element("button", { type: "button", "data-id": id, onclick, disabled }, words);
  const checkbox = (words, checked, onchange, data) => element("label", {}, element("input", { type: "checkbox", checked, onchange: event => onchange(event.target.checked), ...data }), ` ${words}`);
  for (const item of BUTTONS) {
    line.append(item ? button(...item, () => item[0] === "theme" ? theme(!dark) : send({ type: item[0], time }), item[0] !== "theme") : element("span", { className: "sd-gap" }));
  }
  const horizon = checkbox("horizon", false, wanted => send({ type: "horizon", wanted }), { "data-id": "horizon" });
  horizon.title = "predictability horizon: computes each run twice"; horizon.firstChild.after(element("span", { className: "sd-wide" }, " predictability"));
  const state = element("span", { className: "sd-state", role: "status" }), progress = element("progress", { max: 1 }), stop = button("stop", "Stop", () => send({ type: "stop" }));
  // a list that opens below its name
  function menu(name, content, data) {
    const list = element("details", {
      className: "sd-menu", ...data, onkeydown: event => { if (event.key === "Escape") { list.open = false; list.firstChild.focus(); } },
    }, element("summary", {}, name), content);
    list.addEventListener("focusout", event => { if (!list.contains(event.relatedTarget)) setTimeout(() => { if (!list.contains(document.activeElement)) list.open = false; }, 150); });
    return list;
  }
  const choices = element("div"), exported = element("div", {}, ...EXPORTS.map(([id, words]) => button(id, words, () => send({ type: id, time }), true)));
  line.append(menu("Curves", choices), menu("Export", exported, { "data-id": "export" }), horizon, element("span", { className: "sd-now" }, state, progress, stop));

  // which figures there are, each with a box that hides it
  function offer(figures) {
    const names = figures.map(({ name, title }) => name + title).join();
    if (choices.dataset.names === names) return;
    choices.dataset.names = names;
    const choose = name => wanted => { wanted ? curves.hidden.delete(name) : curves.hidden.add(name); curves.choose(); };
    choices.replaceChildren(...figures.map(({ name, title }) => checkbox(title, !curves.hidden.has(name), choose(name), { "data-figure": name })));
  }
  function answers(cards, legend) {
    root.querySelector(".sd-cards").replaceChildren(...cards.map(({ title, value, detail, judged }) =>
      element("div", { className: "sd-card", "data-judged": judged }, `${title} `, element("b", {}, value), element("span", {}, detail))));
    const list = root.querySelector(".sd-legend");
    list.hidden = !legend.length;
    list.replaceChildren(...legend.map(([color, style, words]) =>
      element("li", {}, element("i", { style: `color: var(--sd-${color})`, "data-style": style }), words)));
  }
  function theme(wanted) {
    dark = wanted;
    document.documentElement.dataset.sdTheme = dark ? "dark" : "light";
    by.theme.textContent = dark ? "Light" : "Dark";
    window.dispatchEvent(new Event("scissordyn:theme"));
  }
  const lasting = seconds => seconds < 90 ? `${Math.max(1, Math.round(seconds))} s` : seconds < 5400 ? `${Math.round(seconds / 60)} min` : `${Number((seconds / 3600).toPrecision(2))} h`;
  // what the page waits for, and how long it will take
  function doing() {
    const stage = of.note && run < now.ordered ? `${of.note} shown; ` : "";
    if (!now.fraction) return `${stage}preparing${now.lasting > 1 ? `, for ${lasting(now.lasting)} so far` : ""}`;
    return `${stage}computing${now.left > 1 ? `, about ${lasting(now.left)} left` : ""}`;
  }
  function show() {
    clearTimeout(timer);
    by.undo.disabled = !now.undo; by.redo.disabled = !now.redo; by.unpin.disabled = !of.pins; by.case.disabled = by.python.disabled = !now.ordered;
    by.unpin.textContent = of.pins ? `Unpin ${of.pins}` : "Unpin";
    by.pin.disabled = by.run.disabled = by.curves.disabled = by.picture.disabled = by.film.disabled = !run;
    horizon.firstChild.checked = Boolean(now.horizon);
    const heading = line.querySelector("h1");
    if (now.name) heading.textContent = heading.title = now.name;
    const computing = Boolean(now.computing || (of.note && !words && run < now.ordered));
    Object.assign(state.dataset, { computing, run, ordered: now.ordered || 0, fine: Boolean(of.fine) });
    const write = () => {
      progress.style.display = stop.style.display = computing ? "" : "none";
      if (now.fraction > 0) progress.value = now.fraction; else progress.removeAttribute("value");
      state.textContent = words || (computing ? doing() : now.text || of.text || "");
      state.title = state.textContent === of.text ? of.detail : state.textContent;
      state.dataset.bad = String(Boolean((words && words !== "reading the case") || (now.text && !computing)));
    };
    if (computing && run && !of.note && now.lasting < LATE / 1000) timer = setTimeout(write, LATE); else write();
  }
  function code(text) {
    const leave = () => { dialog.remove(); by.python.closest("details").firstChild.focus(); };
    const area = element("textarea", { value: text, readOnly: true, "aria-label": "the case as Python" }), note = element("span", {}, "Copied to the clipboard.");
    const dialog = element("div", { className: "sd-code", role: "dialog", "aria-label": "copied", onkeydown: event => { if (event.key === "Escape") leave(); } },
      note, area, element("button", { type: "button", onclick: leave }, "Close"));
    root.append(dialog);
    area.focus(); area.select();
    const failed = () => { note.textContent = "Press Ctrl+C to copy."; };
    navigator.clipboard ? navigator.clipboard.writeText(text).catch(failed) : failed();
  }
  window.addEventListener("scissordyn:time", event => { time = event.detail; });
  document.addEventListener("keydown", event => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    const inside = event.target;
    if (inside.tagName === "TEXTAREA" || (inside.tagName === "INPUT" && inside.type === "text")) return;
    event.preventDefault();
    send({ type: event.shiftKey ? "redo" : "undo" });
  });
  show();
  theme(dark);
  const shown = {
    last: "",
    code,
    // what is said stays until the next thing happens
    said(message) { words = shown.last = message.text; show(); if (message.final) stop.style.display = progress.style.display = "none"; },
    state(message) {
      if (message.ordered !== now.ordered || words === "reading the case") words = shown.last = "";
      now = message; show();
    },
    run(message) {
      ({ run, bar: of } = message);
      answers(message.cards, of.legend); offer(message.figures);
      warnings.hidden = !of.warnings.length;
      warnings.querySelector("summary").textContent = of.warnings.length === 1 ? "1 warning" : `${of.warnings.length} warnings`;
      warnings.querySelector("ul").replaceChildren(...of.warnings.map(text => element("li", {}, text)));
      show();
    },
  };
  return shown;
}
