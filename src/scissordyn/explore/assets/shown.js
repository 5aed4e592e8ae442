// What is shown of a run comes in one message and goes to its places here, in one turn of the browser: curves, drawing, table and
// bar have the numbers of one run at every instant.
const [factor, run, shown] = clock.tags;
if (!shown) return;
const quiet = { sync: false };  // not to the server
const put = (model, values) => model.setv(values, quiet);
if (shown.curves) {
  if (shown.until !== clock.until) {  // else a range that somebody has zoomed stays
    clock.until = shown.until;
    put(range, { start: 0, end: shown.until, reset_start: 0, reset_end: shown.until });
  }
  for (const name of ["horizon", "allowed", "pinned", "circle", "pinnedOrbits", "orbit", "curves"])
    if (shown[name]) put(sources[name], { data: shown[name] });
  shown.looks.forEach((look, k) => {
    put(titles[k], { text: look.title });
    put(sizes[k], { axis_label: look.unit });
    put(times[k], { axis_label: shown.time });
    if (legends[k]) legends[k].items.forEach((item, n) => put(item, { label: { value: look.labels[n] }, visible: look.there[n] }));
  });
  // the figures that somebody has chosen, with the times below the last one
  const layout = window.scissordynLayout = () => {
    const there = shown.looks.map((look, k) => look.visible && !(window.scissordynHidden || new Set()).has(figures[k].name));
    const room = (figures.find((_, k) => there[k]).inner_width || 320) + 20;
    figures.forEach((figure, k) => {
      const last = k === there.lastIndexOf(true);
      put(times[k], { visible: last });
      // a legend that is wider than its figure has several rows, which add to the height of the figure
      const drawn = legends[k] ? legends[k].items.filter(item => item.visible) : [];
      const widths = drawn.map(item => 34 + 6.7 * item.label.value.length);
      let across = Math.max(1, drawn.length);
      while (across > 1 && across * Math.max(...widths) > room && !(across === drawn.length && widths.reduce((a, b) => a + b, 0) <= room)) across -= 1;
      const rows = Math.max(1, Math.ceil(drawn.length / across));
      if (legends[k]) put(legends[k], { ncols: across });
      put(figure, { visible: there[k], height: shown.height + 30 * (rows - 1) + last * shown.labels });
    });
  };
  layout();
  if (!window.scissordynResizes) {
    window.scissordynResizes = true;
    let waiting = 0;
    // when the figures have taken their new width
    window.addEventListener("resize", () => { clearTimeout(waiting); waiting = setTimeout(() => window.scissordynLayout(), 200); });
  }
  put(orbit, { visible: Boolean(shown.orbit) });
  if (shown.orbit) {
    const [title, x, y, across, up] = orbitParts, reach = shown.orbitReach;
    put(title, { text: shown.orbitTexts[0] });
    put(x, { axis_label: shown.orbitTexts[1] });
    put(y, { axis_label: shown.orbitTexts[2] });
    for (const each of [across, up]) put(each, { start: -reach, end: reach, reset_start: -reach, reset_end: reach });
  }
}
if (shown.looks) shown.parts.figures = shown.looks.flatMap((look, k) => look.visible ? [{ name: figures[k].name, title: look.title }] : []);
window.scissordynShown = { ...window.scissordynShown, ...shown.parts, run };
window.dispatchEvent(new CustomEvent("scissordyn:shown", { detail: { ...shown.parts, run } }));
// the library draws in the frame after its data have changed
requestAnimationFrame(() => requestAnimationFrame(() => {
  window.scissordynDrawn = { run, at: performance.now() };
  window.dispatchEvent(new CustomEvent("scissordyn:drawn", { detail: run }));
}));
