// The numbers of the case: a form, with a slider for what is starred. An error stands beside its number.

const STYLE = `
.sd-form { font: 13px/1.35 system-ui, sans-serif; color: var(--sd-ink, #222); display: block; overflow-y: auto; height: 100%; box-sizing: border-box; padding: 0 8px 8px 2px }
.sd-form h2 { font-size: 13px; margin: 8px 0 4px }
.sd-form details { border-top: 1px solid var(--sd-line, #ccc); padding: 3px 0 }
.sd-form summary { cursor: pointer; font-weight: 600; padding: 2px 0 }
.sd-row { display: grid; grid-template-columns: 20px 1fr 9.5em; align-items: center; gap: 4px; margin: 2px 0 }
.sd-row label { overflow-wrap: anywhere }
.sd-row input[type=text] { font: inherit; color: inherit; background: var(--sd-field, #f4f4f4); border: 1px solid var(--sd-line, #bbb); border-radius: 4px; padding: 2px 5px; width: 100%; box-sizing: border-box; font-variant-numeric: tabular-nums }
.sd-row input[type=range] { grid-column: 2 / 4; width: 100%; margin: 0 }
.sd-row button { font: inherit; border: 0; background: none; color: var(--sd-faint, #767676); cursor: pointer; padding: 0 }
.sd-row button[aria-pressed=true] { color: var(--sd-trail, #b87700) }
.sd-row .sd-error { grid-column: 1 / 4; color: var(--sd-contact, #b04000); overflow-wrap: anywhere }
.sd-row .sd-error:empty { display: none }
.sd-row input[aria-invalid=true] { border: 2px solid var(--sd-contact, #D55E00) }
`;
const STEPS = 1000;

export function render({ model, el }) {
  const root = document.createElement("div");
  root.className = "sd-form";
  const style = document.createElement("style");
  style.textContent = STYLE;
  el.append(style, root);
  el.style.height = "100%";
  let fields = [], rows = new Map(), stars = null;
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
  let waiting = null;
  function send(field, text, final) {
    if (final) { waiting = null; model.send_msg({ key: field.key, text, final }); return; }
    if (!waiting) setTimeout(() => { if (waiting) model.send_msg(waiting); waiting = null; }, 40);
    waiting = { key: field.key, text, final };
  }
  function row(field, starred) {
    const box = document.createElement("div");
    box.className = "sd-row"; box.dataset.key = field.key;
    const star = document.createElement("button"), label = document.createElement("label"), input = document.createElement("input");
    star.type = "button"; star.textContent = starred ? "★" : "☆"; star.disabled = !field.slider;
    star.setAttribute("aria-pressed", String(starred)); star.setAttribute("aria-label", `slider for ${field.name}`);
    star.title = field.slider ? "a slider for this number" : "";
    star.onclick = () => { stars.has(field.key) ? stars.delete(field.key) : stars.add(field.key); build(); };
    input.type = "text"; input.value = field.text; input.id = `sd-${starred ? "star-" : ""}${field.key}`; input.spellcheck = false;
    label.textContent = starred && field.group ? `${field.group}: ${field.name}` : field.name; label.htmlFor = input.id;
    label.title = input.title = `${field.help}${field.help ? "; " : ""}${field.allowed}`;
    const error = document.createElement("div");
    error.className = "sd-error"; error.setAttribute("role", "alert"); error.id = `${input.id}-error`;
    input.setAttribute("aria-describedby", error.id);
    input.onchange = () => send(field, input.value, true);
    box.append(star, label, input);
    let range = null;
    if (starred && field.slider) {
      range = document.createElement("input");
      range.type = "range"; range.min = 0; range.max = STEPS; range.step = 1; range.value = position(field.slider, field.slider.value);
      range.setAttribute("aria-label", `${field.group} ${field.name}`);
      const slider = { ...field.slider };  // its ends stay while it moves
      range.oninput = () => { input.value = textOf(field, valueAt(slider, Number(range.value))); send(field, input.value, false); };
      range.onchange = () => { window.scissordynReleased = performance.now(); send(field, input.value, true); };
      box.append(range);
    }
    box.append(error);
    return { box, input, range, error, field };
  }
  function build() {
    rows = new Map();
    root.replaceChildren();
    const add = (parent, field, starred) => {
      const made = row(field, starred);
      parent.append(made.box);
      rows.set(field.key, [...(rows.get(field.key) || []), made]);
    };
    const heading = document.createElement("h2");
    heading.textContent = "Sliders";
    root.append(heading);
    for (const field of fields) if (stars.has(field.key)) add(root, field, true);
    const groups = new Map();
    for (const field of fields) { if (!groups.has(field.group)) groups.set(field.group, []); groups.get(field.group).push(field); }
    for (const [name, members] of groups) {
      const details = document.createElement("details"), summary = document.createElement("summary");
      summary.textContent = name; details.append(summary); details.open = open.has(name);
      details.ontoggle = () => details.open ? open.add(name) : open.delete(name);
      for (const field of members) add(details, field, false);
      root.append(details);
    }
    refresh();
  }
  function refresh() {
    const errors = JSON.parse(model.errors || "{}"), typed = JSON.parse(model.typed || "{}");
    for (const [key, several] of rows) for (const { box, input, range, error, field } of several) {
      box.dataset.text = field.text;  // as the case has it
      const wrong = key in errors, active = input.getRootNode().activeElement;
      if (wrong) input.value = typed[key]; else if (!range || active !== range) input.value = field.text;
      input.setAttribute("aria-invalid", String(wrong));
      error.textContent = wrong ? errors[key] : "";
      if (wrong && box.closest("details")) { box.closest("details").open = true; }
      if (range && active !== range && field.slider) range.value = position(field.slider, field.slider.value);
    }
  }
  function load() {
    const before = fields.map(field => field.key).join();
    fields = JSON.parse(model.fields || "[]");
    if (fields.length && !stars) stars = new Set(fields.filter(field => field.starred).map(field => field.key));
    const same = before === fields.map(field => field.key).join();
    if (!same) { build(); performance.mark("scissordyn:numbers"); return; }
    const by = new Map(fields.map(field => [field.key, field]));
    let moved = false;
    for (const [key, several] of rows) for (const made of several) {
      Object.assign(made.field, by.get(key), made.field.slider && by.get(key).slider ? { slider: { ...made.field.slider, value: by.get(key).slider.value } } : {});
      const slider = made.field.slider, value = slider && slider.value;
      if (slider && made.range && made.input.getRootNode().activeElement !== made.range && (value < slider.low || value > slider.high)) moved = true;
    }
    if (moved) build(); else refresh();
  }
  for (const name of ["fields"]) model.on(name, load);
  for (const name of ["errors", "typed"]) model.on(name, refresh);
  load();
}
