// The bar above: undo, runs to compare, what to save, progress and the state of the run.

const STYLE = `
.sd-bar { font: 13px/1.4 system-ui, sans-serif; color: var(--sd-ink, #222); display: flex; flex-wrap: wrap; gap: 6px; align-items: center; padding: 4px 0 }
.sd-bar button { font: inherit; color: inherit; background: var(--sd-field, #f4f4f4); border: 1px solid var(--sd-line, #bbb); border-radius: 4px; padding: 3px 10px; cursor: pointer }
.sd-bar button:disabled { opacity: .45; cursor: default }
.sd-bar strong { margin-right: 8px; font-size: 15px }
.sd-bar progress { width: 9em; accent-color: var(--sd-blue, #0072B2) }
.sd-bar .sd-now { flex: 1 1 23em; display: flex; gap: 6px; align-items: center; margin-left: 14px }
.sd-bar .sd-state { flex: 1 1 0; overflow-wrap: anywhere }
.sd-bar .sd-state[data-bad=true] { color: var(--sd-contact, #b04000) }
.sd-bar .sd-gap { width: 8px }
.sd-warnings { font: 13px/1.4 system-ui, sans-serif; color: var(--sd-ink, #222); margin: 0 0 4px }
.sd-warnings summary { cursor: pointer; color: var(--sd-contact, #b04000) }
.sd-cards { display: flex; flex-wrap: wrap; gap: 4px 8px; margin: 2px 0 4px; font: 12px/1.3 system-ui, sans-serif }
.sd-card { border: 1px solid var(--sd-line, #bbb); border-left-width: 4px; border-radius: 4px; padding: 2px 8px; color: var(--sd-ink, #222) }
.sd-card[data-judged=met] { border-left-color: var(--sd-green, #009E73) }
.sd-card[data-judged=missed] { border-left-color: var(--sd-contact, #b04000) }
.sd-card b { font-size: 14px; margin: 0 4px; font-variant-numeric: tabular-nums }
.sd-card span { color: var(--sd-faint, #5f6670) }
.sd-legend { display: flex; flex-wrap: wrap; gap: 2px 16px; margin: 0 0 4px; padding: 0; list-style: none; font: 12px/1.4 system-ui, sans-serif; color: var(--sd-ink, #222) }
.sd-legend i { display: inline-block; width: 22px; vertical-align: middle; margin-right: 6px; border-top: 2px dashed }
.sd-legend li:first-child i { border-top-style: solid }
.sd-menu { position: relative }
.sd-menu summary { background: var(--sd-field, #f4f4f4); border: 1px solid var(--sd-line, #bbb); border-radius: 4px; padding: 3px 10px; cursor: pointer; list-style: none }
.sd-menu div { position: absolute; z-index: 900; background: var(--sd-back, #fff); border: 1px solid var(--sd-line, #bbb); border-radius: 4px; padding: 6px 10px; display: grid; gap: 3px; white-space: nowrap }
.sd-code { position: fixed; inset: 8% 12%; z-index: 1000; background: var(--sd-back, #fff); color: inherit; border: 1px solid var(--sd-line, #bbb); border-radius: 6px; padding: 12px; display: flex; flex-direction: column; gap: 8px }
.sd-code textarea { flex: 1; font: 12px/1.4 ui-monospace, monospace; color: inherit; background: var(--sd-field, #f4f4f4); border: 1px solid var(--sd-line, #bbb) }
`;
const BUTTONS = [["undo", "Undo"], ["redo", "Redo"], null, ["pin", "Pin run"], ["unpin", "Unpin"], null, ["case", "Save case"], ["run", "Save run"], ["curves", "CSV"],
  ["picture", "Picture"], ["film", "Film"], ["python", "Copy as Python"], null, ["theme", "Dark"]];

export function render({ model, el }) {
  const root = document.createElement("div"), style = document.createElement("style");
  style.textContent = STYLE;
  root.innerHTML = `<div class="sd-bar"><strong></strong></div><details class="sd-warnings" hidden><summary></summary><ul></ul></details><div class="sd-cards" role="group" aria-label="answers of the run"></div><ul class="sd-legend" hidden></ul>`;
  el.append(style, root);
  document.getElementById("sd-start")?.remove();  // what stood there while the page was being made
  const bar = root.querySelector(".sd-bar"), warnings = root.querySelector(".sd-warnings"), by = {};
  let time = 0;
  for (const item of BUTTONS) {
    const made = document.createElement(item ? "button" : "span");
    if (item) {
      [made.dataset.id, made.textContent] = item; made.type = "button"; by[item[0]] = made;
      made.onclick = () => item[0] === "theme" ? theme(!dark) : model.send_msg({ type: item[0], time });
    } else made.className = "sd-gap";
    bar.append(made);
  }
  const horizon = document.createElement("label"), box = document.createElement("input");
  box.type = "checkbox"; box.dataset.id = "horizon"; box.onchange = () => model.send_msg({ type: "horizon", wanted: box.checked });
  horizon.append(box, " predictability horizon"); horizon.title = "computes each run twice";
  const place = document.createElement("span"), state = document.createElement("span");
  const progress = document.createElement("progress"), stop = document.createElement("button");
  progress.max = 1; stop.type = "button"; stop.textContent = "Stop"; stop.dataset.id = "stop"; stop.onclick = () => model.send_msg({ type: "stop" });
  place.className = "sd-now"; state.className = "sd-state"; state.setAttribute("role", "status");
  place.append(state, progress, stop);
  const chosen = document.createElement("details"), choices = document.createElement("div");
  chosen.className = "sd-menu"; chosen.innerHTML = "<summary>Curves</summary>"; chosen.append(choices);
  chosen.onkeydown = event => { if (event.key === "Escape") chosen.open = false; };
  bar.append(chosen, horizon, place);

  // which figures there are, each with a box that hides it
  const hidden = window.scissordynHidden = new Set();
  function offer(figures) {
    const known = figures.map(({ name, title }) => name + title).join();
    if (choices.dataset.known === known) return;
    choices.dataset.known = known;
    choices.replaceChildren(...figures.map(({ name, title }) => {
      const label = document.createElement("label"), box = document.createElement("input");
      box.type = "checkbox"; box.checked = !hidden.has(name); box.dataset.figure = name;
      box.onchange = () => { box.checked ? hidden.delete(name) : hidden.add(name); window.scissordynLayout(); };
      label.append(box, ` ${title}`);
      return label;
    }));
  }
  // an element of a kind with texts and elements in it
  function made(kind, ...inside) { const it = document.createElement(kind); it.append(...inside); return it; }
  function answers(cards, legend) {
    root.querySelector(".sd-cards").replaceChildren(...cards.map(({ title, value, detail, judged }) => {
      const card = made("div", `${title} `, made("b", value), made("span", detail));
      card.className = "sd-card"; card.dataset.judged = judged;
      return card;
    }));
    const list = root.querySelector(".sd-legend");
    list.hidden = !legend.length;
    list.replaceChildren(...legend.map(([color, told], k) => {
      const line = document.createElement("i"); line.style.color = color;
      return made("li", line, `${k ? "pinned" : "now"}: ${told}`);
    }));
  }

  let dark = matchMedia("(prefers-color-scheme: dark)").matches;
  function theme(wanted) {
    dark = wanted;
    document.documentElement.dataset.sdTheme = dark ? "dark" : "light";
    by.theme.textContent = dark ? "Light" : "Dark";
    window.dispatchEvent(new Event("scissordyn:theme"));
    model.send_msg({ type: "theme", dark });
  }
  function show() {
    const { bar: of = {}, run = 0, cards = [], figures = [] } = window.scissordynShown || {};
    const now = JSON.parse(model.state || "{}"), listed = of.warnings || [];
    answers(cards, of.legend || []); offer(figures);
    // the state can arrive before the run that it is about
    if (of.note && !now.bad && run < now.ordered) now.computing = true;
    bar.querySelector("strong").textContent = now.name;
    by.undo.disabled = !now.undo; by.redo.disabled = !now.redo; by.unpin.disabled = !of.pins;
    by.unpin.textContent = of.pins ? `Unpin ${of.pins}` : "Unpin";
    by.pin.disabled = by.run.disabled = by.curves.disabled = by.picture.disabled = by.film.disabled = !run;
    by.case.disabled = !now.file; by.case.title = now.file ? "" : "a saved run has no case file; copy it as Python";
    box.checked = now.horizon;
    progress.style.display = stop.style.display = now.computing ? "" : "none";
    if (now.fraction > 0) progress.value = now.fraction; else progress.removeAttribute("value");
    state.textContent = (now.computing && of.note ? `${of.note}; ${now.text || "computing"}` : now.text || of.text || ""); state.dataset.bad = String(Boolean(now.bad));
    state.dataset.computing = String(Boolean(now.computing)); state.dataset.run = run; state.dataset.ordered = now.ordered || 0; state.dataset.fine = String(Boolean(of.fine));
    warnings.hidden = !listed.length;
    warnings.querySelector("summary").textContent = listed.length === 1 ? "1 warning" : `${listed.length} warnings`;
    warnings.querySelector("ul").replaceChildren(...listed.map(text => { const item = document.createElement("li"); item.textContent = text; return item; }));
  }
  function code(text) {
    const dialog = document.createElement("div"), area = document.createElement("textarea"), close = document.createElement("button");
    dialog.className = "sd-code sd-bar"; dialog.style.display = "flex"; dialog.style.flexWrap = "nowrap"; dialog.style.alignItems = "stretch";
    area.value = text; area.readOnly = true; area.setAttribute("aria-label", "the case as Python");
    close.type = "button"; close.textContent = "Close"; close.onclick = () => dialog.remove();
    const note = document.createElement("span");
    note.textContent = "Copied to the clipboard.";
    dialog.setAttribute("role", "dialog"); dialog.setAttribute("aria-label", "copied");
    dialog.onkeydown = event => { if (event.key === "Escape") { dialog.remove(); by.python.focus(); } };
    dialog.append(note, area, close);
    root.append(dialog);
    area.focus(); area.select();
    const failed = () => { note.textContent = "Press Ctrl+C to copy."; };
    navigator.clipboard ? navigator.clipboard.writeText(text).catch(failed) : failed();
  }
  model.on("state", show);
  model.on("msg:custom", message => {
    if (message.type === "file") {
      const raw = atob(message.content), bytes = Uint8Array.from(raw, letter => letter.charCodeAt(0));
      const link = document.createElement("a");
      link.href = URL.createObjectURL(new Blob([bytes], { type: message.mime }));
      link.download = message.name;
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    } else if (message.type === "python") code(message.text);
  });
  window.addEventListener("scissordyn:shown", show);
  window.addEventListener("scissordyn:time", event => { time = event.detail; });
  const drawn = run => model.send_msg({ type: "drawn", run });
  window.addEventListener("scissordyn:drawn", event => drawn(event.detail));
  if (window.scissordynDrawn) drawn(window.scissordynDrawn.run);  // before this bar was there
  document.addEventListener("keydown", event => {
    if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
    const inside = event.composedPath()[0];
    if (inside && (inside.tagName === "TEXTAREA" || (inside.tagName === "INPUT" && inside.type === "text"))) return;
    event.preventDefault();
    model.send_msg({ type: event.shiftKey ? "redo" : "undo" });
  });
  show();
  theme(dark);
  performance.mark("scissordyn:page");
}
