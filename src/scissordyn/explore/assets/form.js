// The numbers of the case: a form, with a slider for what is starred. An error stands beside its number.
import { element } from "./element.js";
import { influence } from "./influence.js";

const STEPS = 1000;

export function form(root, send) {
  let fields = [], rows = new Map(), stars = null, wrong = {}, chosen = {}, folded = false, waiting = null;
  const open = new Set(), weighed = influence(send, () => build());

  const position = ({ logarithmic, low, high, value }) => Math.round(STEPS * (logarithmic ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low)));
  const valueAt = ({ logarithmic, low, high }, step) => logarithmic ? low * (high / low) ** (step / STEPS) : low + (high - low) * step / STEPS;
  function textOf(field, value) {
    if (field.whole) return String(Math.round(value));
    const number = Number((value / field.factor).toPrecision(4));
    return field.unit ? `${number} ${field.unit}` : String(number);
  }
  function change(field, text, final) {
    const message = { type: "change", key: field.key, text, final };
    if (final) { waiting = null; send(message); return; }
    if (!waiting) setTimeout(() => { if (waiting) send(waiting); waiting = null; }, 40);
    waiting = message;
  }
  function row(parent, field, starred) {
    const id = `sd-${starred ? "star-" : ""}${field.key}`, slider = starred && field.slider && { ...field.slider };  // its ends stay while it moves
    const title = [field.shown === field.text ? "" : field.text, field.help, field.allowed].filter(Boolean).join("; ");
    const input = element("input", { type: "text", value: field.shown, id, title, spellcheck: false, "aria-describedby": `${id}-error`, onchange: () => change(field, input.value, true) });
    const error = element("div", { className: "sd-error", role: "alert", id: `${id}-error` });
    const star = element("button", {
      type: "button", textContent: starred ? "★" : "☆", disabled: !field.slider, title: field.slider ? "a slider for this number" : "",
      "aria-pressed": starred, "aria-label": `slider for ${field.name}`, onclick: () => { stars.has(field.key) ? stars.delete(field.key) : stars.add(field.key); build(); },
    });
    const range = slider && element("input", {
      type: "range", min: 0, max: STEPS, step: 1, value: position(slider), "aria-label": `${field.group} ${field.name}`,
      oninput: () => { input.value = textOf(field, valueAt(slider, Number(range.value))); change(field, input.value, false); },
      onchange: () => { window.scissordyn.released = performance.now(); change(field, input.value, true); },
    });
    const label = element("label", { htmlFor: id, title }, starred && field.group ? `${field.group}: ${field.name}` : field.name);
    const box = element("div", { className: "sd-row", "data-key": field.key }, star, label, input, ...(range ? [range, weighed.cell(field.key)] : []), error);
    parent.append(box);
    rows.set(field.key, [...(rows.get(field.key) || []), { box, input, range, error, field }]);
  }
  function fold(parent, name, text = name) {
    const details = element("details", { open: open.has(name), ontoggle: () => details.open ? open.add(name) : open.delete(name) }, element("summary", {}, text));
    parent.append(details);
    return details;
  }
  function build() {
    const active = root.contains(document.activeElement) ? document.activeElement.id : "", pairs = Object.entries(chosen);
    rows = new Map();
    root.replaceChildren();
    if (pairs.length) root.append(element("h2", {}, "Chosen at this point"), element("dl", {}, ...pairs.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)])));
    root.append(element("h2", {}, "Sliders"), weighed.head);
    const place = field => (weighed.order().indexOf(field.key) + 1) || fields.length + 1, starred = fields.filter(field => stars.has(field.key));
    weighed.begin(starred.filter(field => field.slider).map(field => field.key));
    for (const field of starred.sort((a, b) => place(a) - place(b))) row(root, field, true);
    weighed.ask();
    const parent = folded ? fold(root, "\n", `All ${fields.length} numbers`) : root, groups = new Map();  // no group has this name
    for (const field of fields) {
      if (!groups.has(field.group)) groups.set(field.group, fold(parent, field.group));
      row(groups.get(field.group), field, false);
    }
    refresh();
    if (active) document.getElementById(active)?.focus();
  }
  function refresh() {
    for (const [key, several] of rows) for (const { box, input, range, error, field } of several) {
      box.dataset.text = field.text;  // as the case has it
      const [typed, words] = wrong[key] || [], active = document.activeElement;
      if (words) input.value = typed; else if (!range || active !== range) input.value = field.shown;
      input.setAttribute("aria-invalid", String(Boolean(words)));
      error.textContent = words || "";
      for (let inside = words && box.closest("details"); inside; inside = inside.parentElement.closest("details")) inside.open = true;
      if (words && active === input) error.scrollIntoView({ block: "nearest" });
      if (range && active !== range && field.slider) range.value = position(field.slider);
    }
  }
  function show(message) {
    const layout = () => JSON.stringify([chosen, fields.map(field => field.key)]), before = layout();
    ({ fields, wrong, chosen, folded } = message);
    stars = stars || new Set(fields.filter(field => field.starred).map(field => field.key));
    if (before !== layout()) { build(); performance.mark("scissordyn:numbers"); return; }
    const by = new Map(fields.map(field => [field.key, field]));
    let moved = false;
    for (const [key, several] of rows) for (const shown of several) {
      const next = by.get(key), before = shown.field.slider;
      Object.assign(shown.field, next, before && next.slider ? { slider: { ...before, value: next.slider.value } } : {});
      const slider = shown.field.slider;
      moved ||= Boolean(slider && shown.range && document.activeElement !== shown.range && (slider.value < slider.low || slider.value > slider.high));
    }
    if (moved) build(); else refresh();
  }
  return { show, weighed };
}
