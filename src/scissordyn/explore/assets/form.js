// The numbers of the case: a form, with a slider for what is starred. An error stands beside its number.
const STEPS = 1000;

export function form(root, send) {
  let fields = [], rows = new Map(), stars = null, errors = {}, typed = {}, chosen = {}, folded = false, waiting = null;
  const open = new Set();

  const position = (slider, value) => Math.round(STEPS * (slider.logarithmic
    ? Math.log(value / slider.low) / Math.log(slider.high / slider.low) : (value - slider.low) / (slider.high - slider.low)));
  const valueAt = (slider, step) => slider.logarithmic
    ? slider.low * (slider.high / slider.low) ** (step / STEPS) : slider.low + (slider.high - slider.low) * step / STEPS;
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
  function row(field, starred) {
    const box = document.createElement("div");
    box.className = "sd-row"; box.dataset.key = field.key;
    const star = document.createElement("button"), label = document.createElement("label"), input = document.createElement("input");
    star.type = "button"; star.textContent = starred ? "★" : "☆"; star.disabled = !field.slider;
    star.setAttribute("aria-pressed", String(starred)); star.setAttribute("aria-label", `slider for ${field.name}`);
    star.title = field.slider ? "a slider for this number" : "";
    star.onclick = () => { stars.has(field.key) ? stars.delete(field.key) : stars.add(field.key); build(); };
    input.type = "text"; input.value = field.shown; input.id = `sd-${starred ? "star-" : ""}${field.key}`; input.spellcheck = false;
    label.textContent = starred && field.group ? `${field.group}: ${field.name}` : field.name; label.htmlFor = input.id;
    label.title = input.title = [field.shown === field.text ? "" : field.text, field.help, field.allowed].filter(Boolean).join("; ");
    const error = document.createElement("div");
    error.className = "sd-error"; error.setAttribute("role", "alert"); error.id = `${input.id}-error`;
    input.setAttribute("aria-describedby", error.id);
    input.onchange = () => change(field, input.value, true);
    box.append(star, label, input);
    let range = null;
    if (starred && field.slider) {
      range = document.createElement("input");
      range.type = "range"; range.min = 0; range.max = STEPS; range.step = 1; range.value = position(field.slider, field.slider.value);
      range.setAttribute("aria-label", `${field.group} ${field.name}`);
      const slider = { ...field.slider };  // its ends stay while it moves
      range.oninput = () => { input.value = textOf(field, valueAt(slider, Number(range.value))); change(field, input.value, false); };
      range.onchange = () => { window.scissordyn.released = performance.now(); change(field, input.value, true); };
      box.append(range);
    }
    box.append(error);
    return { box, input, range, error, field };
  }
  function build() {
    const active = document.activeElement && root.contains(document.activeElement) ? document.activeElement.id : "";
    rows = new Map();
    root.replaceChildren();
    const add = (parent, field, starred) => {
      const made = row(field, starred);
      parent.append(made.box);
      rows.set(field.key, [...(rows.get(field.key) || []), made]);
    };
    const titled = (parent, kind, text) => { const it = document.createElement(kind); it.textContent = text; parent.append(it); return it; };
    const fold = (parent, name, text = name) => {
      const details = document.createElement("details");
      titled(details, "summary", text); details.open = open.has(name);
      details.ontoggle = () => details.open ? open.add(name) : open.delete(name);
      parent.append(details);
      return details;
    };
    if (Object.keys(chosen).length) {
      titled(root, "h2", "Chosen at this point");
      const list = titled(root, "dl", "");
      for (const [name, value] of Object.entries(chosen)) { titled(list, "dt", name); titled(list, "dd", value); }
    }
    titled(root, "h2", "Sliders");
    for (const field of fields) if (stars.has(field.key)) add(root, field, true);
    const groups = new Map();
    for (const field of fields) { if (!groups.has(field.group)) groups.set(field.group, []); groups.get(field.group).push(field); }
    const parent = folded ? fold(root, "\n", `All ${fields.length} numbers`) : root;  // no group has this name
    for (const [name, members] of groups) {
      const details = fold(parent, name);
      for (const field of members) add(details, field, false);
    }
    refresh();
    if (active) document.getElementById(active)?.focus();
  }
  function refresh() {
    for (const [key, several] of rows) for (const { box, input, range, error, field } of several) {
      box.dataset.text = field.text;  // as the case has it
      const wrong = key in errors, active = document.activeElement;
      if (wrong) input.value = typed[key]; else if (!range || active !== range) input.value = field.shown;
      input.setAttribute("aria-invalid", String(wrong));
      error.textContent = wrong ? errors[key] : "";
      for (let inside = wrong && box.closest("details"); inside; inside = inside.parentElement.closest("details")) inside.open = true;
      if (wrong && active === input) error.scrollIntoView({ block: "nearest" });
      if (range && active !== range && field.slider) range.value = position(field.slider, field.slider.value);
    }
  }
  function show(message) {
    const layout = () => JSON.stringify([chosen, fields.map(field => field.key)]), before = layout();
    ({ fields, errors, typed, chosen, folded } = message);
    stars = stars || new Set(fields.filter(field => field.starred).map(field => field.key));
    if (before !== layout()) { build(); performance.mark("scissordyn:numbers"); return; }
    const by = new Map(fields.map(field => [field.key, field]));
    let moved = false;
    for (const [key, several] of rows) for (const made of several) {
      const next = by.get(key), before = made.field.slider;
      Object.assign(made.field, next, before && next.slider ? { slider: { ...before, value: next.slider.value } } : {});
      const slider = made.field.slider;
      moved ||= Boolean(slider && made.range && document.activeElement !== made.range && (slider.value < slider.low || slider.value > slider.high));
    }
    if (moved) build(); else refresh();
  }
  return { show };
}
