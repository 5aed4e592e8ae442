// How much an answer of the run changes with the numbers that have sliders: a bar in the row of each, percent for percent. A click
// on it draws in all curves how they change.
import { element } from "./element.js";

export function influence(send, sorted) {
  let keys = [], asked = "", drawn = "", chosen = "", run = 0, found = null, order = [], cells = new Map();
  const on = element("input", { type: "checkbox", onchange: ask });
  const answer = element("select", { "aria-label": "answer", onchange: () => { chosen = answer.value; show(); } });
  const sort = element("button", { type: "button", onclick: () => { order = byInfluence(); sorted(); } }, "Sort");
  const words = element("div", { role: "status" });
  const head = element("div", { className: "sd-influence", hidden: true }, element("label", {}, on, " influence on "), answer, sort, words);

  const percent = key => found?.rows[key]?.elasticity?.[found.measures.indexOf(answer.value)] ?? NaN;
  const size = key => Number.isFinite(percent(key)) ? Math.abs(percent(key)) : -1;
  const byInfluence = () => [...keys].sort((a, b) => size(b) - size(a));
  function ask() {
    const wish = JSON.stringify([on.checked, keys, drawn]);
    if (wish !== asked) { asked = wish; send({ type: "influence", keys: on.checked ? keys : [], drawn: on.checked ? drawn : "" }); }
    if (!on.checked) { found = null; drawn = ""; }
    show();
  }
  function show() {
    const current = Boolean(found && found.run === run), known = on.checked && found && !found.reason;
    const largest = Math.max(...keys.map(size), 1e-9);
    sort.disabled = !known;
    sort.title = `sort the sliders by influence on ${answer.selectedOptions[0]?.text}`;
    words.textContent = !on.checked ? "" : !current ? "computing …" : found.reason ? `not available: ${found.reason}`
      : `change of the answer if the number grows by 1 %; click a bar to draw the change of the curves${found.note && `; ${found.note}`}`;
    for (const [key, cell] of cells) {
      const row = known && found.rows[key], value = percent(key);
      cell.hidden = !row;
      if (!row) continue;
      cell.dataset.stale = String(!current);
      cell.setAttribute("aria-pressed", String(drawn === key));
      const [bar, text] = cell.children, wide = Number.isFinite(value) ? 50 * Math.abs(value) / largest : 0;
      bar.firstChild.style.cssText = `width: ${wide}%; left: ${value < 0 ? 50 - wide : 50}%; background: var(--sd-${value < 0 ? "orange" : "blue"})`;
      text.textContent = Number.isFinite(value) ? `${value < 0 ? "\u2212" : "+"}${Math.abs(value).toPrecision(3)} %` : "-";
      if (row.until) text.append(element("small", {}, `until ${row.until}`));
      cell.title = row.why || (!Number.isFinite(value) ? "no derivative: the largest value is at a kink, or the answer is zero" : row.until ? `later, a change of ${100 * found.change} % is not small any more` : "");
    }
  }
  return {
    head, ask, order: () => order,
    // the rows of the form are made anew
    begin(starred) { keys = starred; cells = new Map(); },
    cell(key) {
      const cell = element("button", { type: "button", className: "sd-effect", hidden: true, onclick: () => { drawn = drawn === key ? "" : key; ask(); } },
        element("span", {}, element("i")), element("b"));
      cells.set(key, cell);
      return cell;
    },
    show(message) { found = message; show(); },
    run(message) {
      run = message.run;
      answer.replaceChildren(...message.measures.map(([name, label]) => new Option(label, name, false, name === chosen)));
      head.hidden = !message.measures.length;
      show();
    },
  };
}
