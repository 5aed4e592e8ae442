// The contacts of the run that is shown: a table of which only the rows in sight are made, however many there are.

const STYLE = `
.sd-contacts { font: 12px/1.4 system-ui, sans-serif; color: var(--sd-ink, #222); background: var(--sd-back, #fff); height: 100%; overflow: auto;
  font-variant-numeric: tabular-nums; outline-offset: -2px }
.sd-contacts [role=row] { display: grid; grid-template-columns: 2.2em minmax(5em, 1.6fr) repeat(5, minmax(5.6em, 1fr)); min-width: 35.2em; height: 22px;
  align-items: center; box-sizing: border-box; border-bottom: 1px solid var(--sd-fill, #e4e4e4); cursor: pointer }
.sd-contacts [role=row] > * { padding: 0 4px; overflow: hidden; text-overflow: ellipsis; white-space: nowrap; text-align: right }
.sd-contacts [role=row] > :nth-child(2) { text-align: left }
.sd-contacts .sd-head { position: sticky; top: 0; z-index: 1; background: var(--sd-back, #fff); font-weight: 600; height: 52px; align-items: end }
.sd-contacts .sd-head > * { white-space: normal !important; font-size: 11px }
.sd-contacts .sd-rows { position: relative; min-width: 35.2em }
@media (max-width: 459px) { .sd-contacts { font-size: 10.5px } .sd-contacts .sd-head > * { font-size: 9.5px; padding: 0 1px 0 2px } }
.sd-contacts .sd-rows [role=row] { position: absolute; left: 0; right: 0 }
.sd-contacts [aria-selected=true] { background: var(--sd-fill, #e4e4e4) }
`;
const HIGH = 22, HEAD = 52;

export function render({ model, el }) {
  const style = document.createElement("style"), root = document.createElement("div");
  style.textContent = STYLE;
  root.className = "sd-contacts"; root.tabIndex = 0; root.setAttribute("role", "grid"); root.setAttribute("aria-label", "contacts");
  root.innerHTML = `<div class="sd-head" role="row"></div><div class="sd-rows"></div>`;
  el.append(style, root); el.style.height = "100%";
  const [head, rows] = root.children;
  let table = { joints: [], seconds: [], columns: [] }, order = [], chosen = -1, sorted = null;

  const cells = k => [String(k + 1), table.joints[k], ...table.columns.map(column => numeral(column.values[k], column.places))];
  const values = column => column === 0 ? null : column === 1 ? table.joints : table.columns[column - 2].values;
  function sort() {
    order = table.joints.map((_, k) => k);
    const by = sorted && values(sorted.column);
    if (by) order.sort((a, b) => (by[a] < by[b] ? -1 : by[a] > by[b] ? 1 : a - b));
    if (sorted && sorted.down) order.reverse();
  }
  function row(place, k) {
    const made = document.createElement("div");
    made.setAttribute("role", "row"); made.setAttribute("aria-selected", String(k === chosen)); made.style.top = `${HIGH * place}px`;
    made.append(...cells(k).map(words => { const cell = document.createElement("span"); cell.setAttribute("role", "gridcell"); cell.textContent = words; return cell; }));
    made.onclick = () => choose(place);
    return made;
  }
  function choose(place) {
    if (place < 0 || place >= order.length) return;
    chosen = order[place];
    const top = HIGH * place;
    if (top < root.scrollTop) root.scrollTop = top;
    else if (top + HIGH + HEAD > root.scrollTop + root.clientHeight) root.scrollTop = top + HIGH + HEAD - root.clientHeight;
    draw();
    window.dispatchEvent(new CustomEvent("scissordyn:go", { detail: table.seconds[chosen] }));
  }
  function draw() {
    const first = Math.max(0, Math.floor(root.scrollTop / HIGH) - 2), last = Math.ceil((root.scrollTop + root.clientHeight) / HIGH) + 2;
    rows.replaceChildren(...order.slice(first, last).map((k, n) => row(first + n, k)));
  }
  function titles() {
    head.replaceChildren(...["#", "joint", ...table.columns.map(column => column.title)].map((words, column) => {
      const cell = document.createElement("span");
      cell.setAttribute("role", "columnheader"); cell.title = "sort";
      cell.textContent = words + (sorted && sorted.column === column ? (sorted.down ? " ▾" : " ▴") : "");
      cell.onclick = () => {
        sorted = sorted && sorted.column === column && sorted.down ? null : { column, down: Boolean(sorted && sorted.column === column) };
        titles(); sort(); draw();
      };
      return cell;
    }));
  }
  function show(shown) {
    if (!shown.table) return;
    table = shown.table; chosen = -1;
    rows.style.height = `${HIGH * table.joints.length}px`;
    sort(); titles(); draw();
    root.dataset.run = shown.run;
  }
  root.addEventListener("scroll", draw);
  root.addEventListener("keydown", event => {
    const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
    if (!step) return;
    event.preventDefault();
    choose(chosen < 0 ? 0 : Math.min(order.length - 1, Math.max(0, order.indexOf(chosen) + step)));
  });
  root.rows = () => table.joints.map((_, k) => cells(k));  // all of them, for tests
  const onShown = event => show(event.detail);
  window.addEventListener("scissordyn:shown", onShown);
  const size = new ResizeObserver(draw);
  size.observe(root);
  show(window.scissordynShown || {});
  model.on("remove", () => { window.removeEventListener("scissordyn:shown", onShown); size.disconnect(); });
}
