// The contacts of the run that is shown: a table of which only the rows in sight are made, however many there are.
import { element } from "./element.js";

const HIGH = 22, HEAD = 46;

// ---- A number of a table as text, see numeral.py, which says the same: three significant digits or more, trailing zeros kept.
const LEAST_FIGURES = 3, MOST_PLACES = 7;

function numeral(value, places = 0) {
  if (!Number.isFinite(value)) return "-";
  if (value === 0) return (0).toFixed(Math.min(places, MOST_PLACES));
  const exponent = exponentOf(value), wanted = Math.max(places, LEAST_FIGURES - 1 - exponent, 0);
  if (wanted <= MOST_PLACES && exponent < MOST_PLACES) return value.toFixed(wanted);
  return value.toExponential(LEAST_FIGURES - 1).replace("e+", "e");
}

function exponentOf(value) {
  return Number(value.toExponential(20).split("e")[1]);
}
// ---- the table

export function table(root, go) {
  root.innerHTML = `<div class="sd-head" role="row"></div><div class="sd-rows" role="rowgroup"></div>`;
  const [head, rows] = root.children;
  let content = { joints: [], seconds: [], columns: [] }, order = [], chosen = -1, sorted = null;

  const cells = k => [String(k + 1), content.joints[k], ...content.columns.map(column => numeral(column.values[k], column.places))];
  const values = column => column === 0 ? null : column === 1 ? content.joints : content.columns[column - 2].values;
  function sort() {
    order = content.joints.map((_, k) => k);
    const by = sorted && values(sorted.column);
    if (by) order.sort((a, b) => (by[a] < by[b] ? -1 : by[a] > by[b] ? 1 : a - b));
    if (sorted && sorted.down) order.reverse();
  }
  function row(place, k) {
    const inside = cells(k).map(words => element("span", { role: "gridcell" }, words));
    return element("div", { role: "row", "aria-selected": String(k === chosen), style: `top: ${HIGH * place}px`, onclick: () => choose(place) }, ...inside);
  }
  function choose(place) {
    if (place < 0 || place >= order.length) return;
    chosen = order[place];
    const top = HIGH * place;
    if (top < root.scrollTop) root.scrollTop = top;
    else if (top + HIGH + HEAD > root.scrollTop + root.clientHeight) root.scrollTop = top + HIGH + HEAD - root.clientHeight;
    draw();
    go(content.seconds[chosen]);
  }
  function draw() {
    const first = Math.max(0, Math.floor(root.scrollTop / HIGH) - 2), last = Math.ceil((root.scrollTop + root.clientHeight) / HIGH) + 2;
    rows.replaceChildren(...order.slice(first, last).map((k, n) => row(first + n, k)));
  }
  function titles() {
    head.replaceChildren(...["#", "joint", ...content.columns.map(column => column.title)].map((words, column) => {
      const here = sorted && sorted.column === column;
      const onclick = () => { sorted = here && sorted.down ? null : { column, down: Boolean(here) }; titles(); sort(); draw(); head.children[column].focus(); };
      return element("button", { type: "button", role: "columnheader", title: "sort", onclick }, words + (here ? (sorted.down ? " ▾" : " ▴") : ""));
    }));
  }
  root.addEventListener("scroll", draw);
  root.addEventListener("keydown", event => {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    choose(chosen < 0 ? 0 : Math.min(order.length - 1, Math.max(0, order.indexOf(chosen) + step)));
  });
  new ResizeObserver(draw).observe(root);
  return {
    show(shown, run) {
      content = shown; chosen = -1;
      root.style.setProperty("--columns", content.columns.length);
      rows.style.height = `${HIGH * content.joints.length}px`;
      sort(); titles(); draw();
      root.dataset.run = run;
    },
    rows: () => content.joints.map((_, k) => cells(k)),  // all of them, for tests
  };
}
