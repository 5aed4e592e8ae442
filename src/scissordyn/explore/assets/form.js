// The numbers of the case: a form, with a slider for what is starred. An error stands beside its number.
const STEPS = 1000;

export function form(root, send) {
  let fields = [], rows = new Map(), stars = null, errors = {}, typed = {}, waiting = null;
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
    if (active) document.getElementById(active)?.focus();
  }
  function refresh() {
    for (const [key, several] of rows) for (const { box, input, range, error, field } of several) {
      box.dataset.text = field.text;  // as the case has it
      const wrong = key in errors, active = document.activeElement;
      if (wrong) input.value = typed[key]; else if (!range || active !== range) input.value = field.shown;
      input.setAttribute("aria-invalid", String(wrong));
      error.textContent = wrong ? errors[key] : "";
      if (wrong && box.closest("details")) box.closest("details").open = true;
      if (wrong && active === input) error.scrollIntoView({ block: "nearest" });
      if (range && active !== range && field.slider) range.value = position(field.slider, field.slider.value);
    }
  }
  function show(message) {
    const before = fields.map(field => field.key).join();
    ({ fields, errors, typed } = message);
    stars = stars || new Set(fields.filter(field => field.starred).map(field => field.key));
    if (before !== fields.map(field => field.key).join()) { build(); performance.mark("scissordyn:numbers"); return; }
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
