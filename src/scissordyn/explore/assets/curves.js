// Curves on canvases: axes, grid, lines with their gaps and peaks, a cursor, zoom and pan, legends, keys. A figure is what
// answers.py and case.py make: { name, title, unit, axis, lines: [{ label, color, x, y, style }], levels, reach }. All figures of a group have
// one range in x, [from, to]; that in y is of what is seen.
import { element } from "./element.js";

const LEFT = 62, RIGHT = 12, TOP = 6, BOTTOM = 22, HIGH = 112, NEAR = 9;  // room of axes, height of a figure, reach of a click [pixel]
const SHORT = 64;  // points of one path
const DASHES = { solid: [], dash: [6, 3], dots: [2, 2], level: [8, 3, 2, 3] };

// ticks at 1, 2 or 5 times a power of ten
export function ticks(low, high, most) {
  const wide = (high - low) / Math.max(1, most), power = 10 ** Math.floor(Math.log10(wide));
  const step = [1, 2, 5, 10].map(part => part * power).find(size => size >= wide * (1 - 1e-9));
  const places = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  const plain = places < 6 && Math.max(Math.abs(low), Math.abs(high)) < 1e6;
  const written = value => plain ? (Math.abs(value) < 1e-9 * step ? 0 : value).toFixed(places) : value === 0 ? "0" : value.toPrecision(4).replace(/\.?0+(e|$)/, "$1");
  return found.map(value => [value, written(value).replaceAll("-", "\u2212")]);
}

// first index whose x is not smaller, of x that does not fall
export function lowerBound(x, value) {
  let low = 0, high = x.length;
  while (low < high) { const middle = (low + high) >> 1; if (x[middle] < value) low = middle + 1; else high = middle; }
  return low;
}

// the points of a line that its drawing needs, x and y in turn, NaN in a gap: of many points in one column of pixels the first, the
// lowest, the highest and the last
export function decimated(x, y, from, to, columns) {
  const first = Math.max(0, lowerBound(x, from) - 1), last = Math.min(x.length - 1, lowerBound(x, to));
  if (last - first < 2 * columns) {
    const all = new Float64Array(2 * Math.max(0, last - first + 1));
    for (let k = first, n = 0; k <= last; k++) { all[n++] = x[k]; all[n++] = Number.isFinite(y[k]) ? y[k] : NaN; }
    return all;
  }
  const wide = (to - from) / columns, points = new Float64Array(12 * (columns + 3));
  let k = first, n = 0;
  const put = at => { points[n++] = x[at]; points[n++] = y[at]; };
  while (k <= last) {
    const end = from + (Math.floor((x[k] - from) / wide) + 1) * wide, start = k;
    let low = -1, high = -1, from_ = -1, to_ = -1, gap = false;
    do {
      const value = y[k];
      if (Number.isFinite(value)) {
        if (from_ < 0) from_ = low = high = k;
        else if (value < y[low]) low = k; else if (value > y[high]) high = k;
        to_ = k;
      } else gap = true;
      k++;
    } while (k <= last && x[k] < end);
    if (gap && (from_ < 0 || from_ > start)) { points[n++] = x[start]; points[n++] = NaN; }
    if (from_ < 0) continue;
    put(from_);
    for (const inner of low < high ? [low, high] : [high, low]) if (inner !== from_ && inner !== to_) put(inner);
    if (to_ !== from_) put(to_);
    if (gap && to_ < k - 1) { points[n++] = x[k - 1]; points[n++] = NaN; }
  }
  return points.subarray(0, n);
}

export class Curves {
  // root: where the figures stand. onPick(x): somebody has chosen a place of the x axis, or (point) one of a scatter
  constructor(root, { onPick = () => {}, square = 0 } = {}) {
    Object.assign(this, { root, onPick, square, views: new Map(), hidden: new Set(), order: [], full: [0, 1], range: [0, 1], cursor: 0, horizon: null, wanted: false });
    this.size = new ResizeObserver(() => this.redraw());
    this.size.observe(root);
  }

  show(figures, { full = null, horizon = null, run = 0 } = {}) {
    this.horizon = horizon;
    if (full && (full[0] !== this.full[0] || full[1] !== this.full[1])) { this.full = full; this.range = [...full]; }
    for (const [name, view] of this.views) if (!figures.some(figure => figure.name === name)) { view.box.remove(); this.views.delete(name); }
    this.order = figures.map(figure => {
      const view = this.views.get(figure.name) || this.make(figure.name);
      view.figure = figure;
      this.caption(view);
      return view;
    });
    if (this.order.some((view, k) => this.root.children[k] !== view.box)) this.root.append(...this.order.map(view => view.box));
    this.root.dataset.run = run;
    this.choose();
  }

  choose() {
    for (const view of this.order) view.box.hidden = this.hidden.has(view.figure.name);
    const seen = this.order.filter(view => !view.box.hidden);
    seen.forEach((view, k) => { view.last = k === seen.length - 1; });
    this.redraw();
  }

  make(name) {
    const caption = element("figcaption"), canvas = element("canvas", { tabIndex: 0, role: "img" }), line = element("div", { className: "sd-cursor" });
    const box = element("figure", { "data-figure": name }, caption, element("div", { className: "sd-plot" }, canvas, line));
    const view = { box, caption, canvas, line, figure: null, range: null, last: false };
    this.views.set(name, view);
    this.listen(view);
    return view;
  }

  caption(view) {
    const { title, unit, lines } = view.figure, words = JSON.stringify([title, unit, lines.map(({ label, color }) => [label, color])]);
    if (view.words === words) return;
    view.words = words;
    const save = element("button", { type: "button", title: "save this figure as a picture", onclick: () => this.save(view) }, "PNG");
    const labels = lines.filter(line => line.label).map(line => element("span", {}, element("i", { style: `color: var(--sd-${line.color})` }), line.label));
    view.caption.replaceChildren(element("b", {}, unit ? `${title} [${unit}]` : title), ...labels, save);
    view.canvas.setAttribute("aria-label", `${title}${labels.length ? ": " : ""}${labels.map(label => label.textContent).join(", ")}`
      + "; plus and minus zoom, arrow keys move, Home shows all" + (this.square ? "" : ", Enter goes to the cursor"));
  }

  save(view) {
    element("a", { href: view.canvas.toDataURL("image/png"), download: `${view.figure.name}.png` }).click();
  }

  // ---- places
  plot({ width, height, last, figure }) {
    return { left: LEFT, right: width - RIGHT, top: TOP, bottom: height - (figure.own ? 2 * BOTTOM - 6 : last || this.square ? BOTTOM : 6) };
  }
  // a figure over time has the range of its group
  own(view) { return this.square || view.figure.own; }
  whole(view) { return this.own(view) ? view.figure.full || [-view.figure.reach, view.figure.reach] : this.full; }
  across(view) { return this.own(view) ? view.range || this.whole(view) : this.range; }
  zoom(view, from, to) {
    const own = this.own(view), [low, high] = this.whole(view), wide = Math.min(to - from, high - low);
    if (!(wide > 1e-9 * (high - low))) return;
    const start = Math.max(low, Math.min(from, high - wide)), next = [start, start + wide];
    if (own) view.range = wide >= (high - low) * (1 - 1e-9) ? null : next; else this.range = next;
    if (!view.range) view.middle = 0;
    this.redraw();
  }
  at(view, pixel) {
    const { left, right } = this.plot(view), [from, to] = this.across(view);
    return from + (pixel - left) / (right - left) * (to - from);
  }

  height(view, event) {
    const { top, bottom } = this.plot(view), [low, high] = view.up;
    return high - (event.clientY - view.canvas.getBoundingClientRect().top - top) / (bottom - top) * (high - low);
  }

  // ---- drawing
  redraw() { if (!this.wanted) { this.wanted = true; requestAnimationFrame(() => this.draw()); } }
  draw() {
    this.wanted = false;
    const style = getComputedStyle(this.root), colors = {}, seen = this.order.filter(view => !view.box.hidden);
    const color = name => colors[name] ??= style.getPropertyValue(`--sd-${name}`).trim() || name;
    // where there is room all figures stand below each other without scrolling
    const room = style.getPropertyValue("--sd-fills") === "1" ? this.root.clientHeight - BOTTOM - seen.reduce((sum, view) => sum + view.caption.offsetHeight + 3, 0) : 0;
    const high = room ? Math.max(HIGH - 20, Math.min(240, Math.floor(room / seen.length))) : HIGH;
    for (const view of seen) {
      const wanted = `${this.square || (view.figure.high || high) + (view.figure.own ? 2 * BOTTOM - 12 : view.last ? BOTTOM - 6 : 0)}px`;
      if (view.canvas.style.height !== wanted) view.canvas.style.height = wanted;
    }
    for (const view of seen) [view.width, view.height] = [view.canvas.clientWidth, view.canvas.clientHeight];
    for (const view of seen) this.drawView(view, color);
    this.move(this.cursor);
  }

  drawView(view, color) {
    const { canvas, figure, width, height } = view, ratio = window.devicePixelRatio || 1, { left, right, top, bottom } = this.plot(view);
    if (width < LEFT + 40) return;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) { canvas.width = Math.round(width * ratio); canvas.height = Math.round(height * ratio); }
    const context = canvas.getContext("2d", { alpha: false }), [from, to] = this.across(view);
    const lines = figure.lines.map(line => ({ ...line, points: this.points(line, from, to, right - left) }));
    const [low, high] = view.up = this.up(view, lines);
    const X = x => left + (x - from) / (to - from) * (right - left), Y = y => bottom - (y - low) / (high - low) * (bottom - top);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = color("back"); context.fillRect(0, 0, width, height);
    if (this.horizon !== null && !this.own(view) && this.horizon < to) {
      context.fillStyle = color("fill"); context.globalAlpha = 0.6;
      context.fillRect(Math.max(left, X(this.horizon)), top, right - Math.max(left, X(this.horizon)), bottom - top); context.globalAlpha = 1;
    }
    this.axes(context, view, { left, right, top, bottom, from, to, low, high, X, Y, color });
    context.save(); context.beginPath(); context.rect(left, top - 1, right - left, bottom - top + 2); context.clip();
    for (const level of figure.levels || []) {
      context.strokeStyle = color("faint"); context.lineWidth = 1.3; context.setLineDash(DASHES.level);
      context.beginPath(); context.moveTo(left, Y(level)); context.lineTo(right, Y(level)); context.stroke();
    }
    for (const line of lines) {
      context.strokeStyle = context.fillStyle = color(line.color); context.lineWidth = line.style === "dash" ? 1.2 : 1.5; context.lineJoin = "bevel";
      context.setLineDash(DASHES[line.style] || []);
      if (line.style === "points") this.scatter(context, line, X, Y, color("ink"));
      else if (line.style === "band") this.band(context, line, from, to, X, Y);
      else this.stroke(context, line.points, X, Y, line.style === "solid" ? SHORT : Infinity);
    }
    context.restore();
  }

  // in short paths, which are drawn faster than a long one
  stroke(context, points, X, Y, most) {
    let length = 0;
    context.beginPath();
    for (let n = 0; n < points.length; n += 2) {
      const y = points[n + 1];
      if (y !== y) { length = 0; continue; }
      const [px, py] = [X(points[n]), Y(y)];
      if (length++) context.lineTo(px, py); else context.moveTo(px, py);
      if (length > most) { context.stroke(); context.beginPath(); context.moveTo(px, py); length = 1; }
    }
    context.stroke();
  }
  // the part of the plane within `size` of a curve, with gaps where that is not known
  band(context, { x, y, size }, from, to, X, Y) {
    const first = Math.max(1, lowerBound(x, from)), last = Math.min(x.length - 1, lowerBound(x, to));
    context.globalAlpha = 0.35; context.beginPath();
    for (let k = first; k <= last; k++) {
      if (!(size[k - 1] + size[k] >= 0)) continue;
      const [left, right] = [X(x[k - 1]), X(x[k])];
      context.moveTo(left, Y(y[k - 1] - size[k - 1])); context.lineTo(left, Y(y[k - 1] + size[k - 1]));
      context.lineTo(right, Y(y[k] + size[k])); context.lineTo(right, Y(y[k] - size[k])); context.closePath();
    }
    context.fill(); context.globalAlpha = 1;
  }
  scatter(context, { points, sizes }, X, Y, ink) {
    for (let n = 0; n < points.length; n += 2) {
      if (points[n + 1] !== points[n + 1]) continue;
      const size = sizes ? sizes[n / 2] : 1.6;
      context.beginPath(); context.arc(X(points[n]), Y(points[n + 1]), size, 0, 7); context.fill();
      if (size > 4) { context.strokeStyle = ink; context.lineWidth = 1.5; context.stroke(); }
    }
  }

  points(line, from, to, columns) {
    if (!this.square && line.style !== "points") return decimated(line.x, line.y, from, to, columns);
    const points = new Float64Array(2 * line.x.length);
    for (let k = 0; k < line.x.length; k++) { points[2 * k] = line.x[k]; points[2 * k + 1] = Number.isFinite(line.x[k]) ? line.y[k] : NaN; }
    return points;
  }

  // the range in y: of the points that are seen and of what is allowed, a little wider; of what does not change some room around it
  up(view, lines) {
    if (this.square) {
      const [from, to] = this.across(view), middle = view.middle || 0;
      const { left, right, top, bottom } = this.plot(view), half = (to - from) / 2 * (bottom - top) / (right - left);
      return [middle - half, middle + half];
    }
    const [from, to] = this.across(view);
    let low = Infinity, high = -Infinity;
    for (const { points } of lines) for (let n = 0; n < points.length; n += 2) {
      const y = points[n + 1];
      if (points[n] >= from && points[n] <= to) { if (y < low) low = y; if (y > high) high = y; }
    }
    for (const level of view.figure.levels || []) { low = Math.min(low, level); high = Math.max(high, level); }
    if (low > high) return [0, 1];
    const room = Math.max(0.06 * (high - low), 1e-9 * Math.max(Math.abs(low), Math.abs(high))) || 0.5;
    return [low - room, high + room];
  }

  axes(context, view, { left, right, top, bottom, from, to, low, high, X, Y, color }) {
    const { figure, last } = view, labelled = last || this.own(view);
    context.font = "11px system-ui, sans-serif"; context.lineWidth = 1; context.setLineDash([]);
    context.textBaseline = "middle"; context.textAlign = "right";
    const upright = ticks(low, high, Math.max(2, (bottom - top) / 20)), along = ticks(from, to, Math.max(2, (right - left) / 70));
    for (const [value, words] of figure.ticks || upright) {
      const y = Math.round(Y(value)) + 0.5;
      context.strokeStyle = color("fill"); context.beginPath(); context.moveTo(left, y); context.lineTo(right, y); context.stroke();
      context.fillStyle = color("ink"); context.fillText(words, left - 6, y);
    }
    context.textAlign = "center"; context.textBaseline = "top";
    let until = left - 30;
    const name = figure.axis, wide = figure.own ? -8 : context.measureText(name).width;
    for (const [value, words] of along) {
      const x = Math.round(X(value)) + 0.5, half = context.measureText(words).width / 2;
      context.strokeStyle = color("fill"); context.beginPath(); context.moveTo(x, top); context.lineTo(x, bottom); context.stroke();
      if (!labelled || x - half < until || x + half > right - wide - 8) continue;  // the name of the axis stands at its end
      until = x + half + 6; context.fillStyle = color("ink"); context.fillText(words, x, bottom + 6);
    }
    if (labelled) { context.textAlign = "right"; context.fillStyle = color("ink"); context.fillText(name, right, bottom + (figure.own ? BOTTOM - 2 : 6)); }
    context.strokeStyle = color("line"); context.strokeRect(left + 0.5, top + 0.5, right - left - 1, bottom - top - 1);
  }

  // the cursor at a place of the x axis
  move(x) {
    this.cursor = x;
    for (const view of this.order) {
      if (!view.width) continue;
      const { left, right, top, bottom } = this.plot(view), [from, to] = this.across(view), pixel = left + (x - from) / (to - from) * (right - left);
      view.line.hidden = this.own(view) || view.box.hidden || !(pixel >= left && pixel <= right);
      view.line.style.cssText = `transform:translateX(${pixel.toFixed(1)}px);top:${top}px;height:${bottom - top}px`;
    }
  }

  // ---- pointer and keys
  listen(view) {
    const { canvas, line } = view, where = event => event.clientX - canvas.getBoundingClientRect().left;
    let hold = null;
    const band = element("div", { className: "sd-band", hidden: true });
    line.after(band);
    canvas.addEventListener("wheel", event => {
      event.preventDefault();
      const here = this.at(view, where(event)), [from, to] = this.across(view), factor = Math.exp(0.0015 * event.deltaY);
      if (this.square) { const up = this.height(view, event); view.middle = up + ((view.middle || 0) - up) * factor; }
      this.zoom(view, here - (here - from) * factor, here + (to - here) * factor);
    }, { passive: false });
    canvas.addEventListener("pointerdown", event => {
      canvas.setPointerCapture(event.pointerId);
      hold = { x: where(event), y: event.clientY - canvas.getBoundingClientRect().top, middle: view.middle || 0, range: [...this.across(view)], pan: event.shiftKey || this.square || event.button === 1, moved: false };
    });
    canvas.addEventListener("pointermove", event => {
      if (!hold) return;
      const x = where(event), { left, right, top, bottom } = this.plot(view), [from, to] = hold.range;
      hold.moved ||= Math.abs(x - hold.x) > 4;
      if (!hold.moved) return;
      if (hold.pan) {
        const pixel = (to - from) / (right - left), by = (hold.x - x) * pixel;
        view.middle = hold.middle + (event.clientY - canvas.getBoundingClientRect().top - hold.y) * pixel;
        this.zoom(view, from + by, to + by);
        return;
      }
      const ends = [hold.x, x].map(each => Math.max(left, Math.min(each, right))).sort((a, b) => a - b);
      band.hidden = false; band.style.cssText = `left:${ends[0]}px;width:${ends[1] - ends[0]}px;top:${top}px;height:${bottom - top}px`;
    });
    const end = event => {
      if (!hold) return;
      const { x, y, pan, moved } = hold;
      hold = null; band.hidden = true;
      if (moved && !pan && event.type === "pointerup") this.zoom(view, ...[this.at(view, x), this.at(view, where(event))].sort((a, b) => a - b));
      else if (!moved) this.pick(view, x, y);
    };
    for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, end);
    const all = () => { view.range = null; if (!this.own(view)) this.range = [...this.full]; this.redraw(); };
    canvas.addEventListener("dblclick", all);
    canvas.addEventListener("keydown", event => {
      const [from, to] = this.across(view), wide = to - from;
      const actions = {
        "+": () => this.zoom(view, from + 0.2 * wide, to - 0.2 * wide), "=": () => actions["+"](), "-": () => this.zoom(view, from - 0.35 * wide, to + 0.35 * wide),
        ArrowLeft: () => this.zoom(view, from - 0.1 * wide, to - 0.1 * wide), ArrowRight: () => this.zoom(view, from + 0.1 * wide, to + 0.1 * wide),
        Home: all, Enter: () => this.step(view, event.shiftKey ? -1 : 1),
      };
      if (!actions[event.key] || event.ctrlKey || event.metaKey) return;
      event.preventDefault(); actions[event.key]();
    });
  }

  // a click: the nearest point of a scatter, else a place of the x axis
  pick(view, x, y) {
    if (this.square) return;
    const { left, right, top, bottom } = this.plot(view), [from, to] = this.across(view), [low, high] = view.up;
    const scatter = view.figure.lines.filter(line => line.keys);
    if (!scatter.length) { if (x >= left && x <= right) this.onPick(this.at(view, x), null, view); return; }
    let best = [NEAR, null];
    for (const line of scatter) line.x.forEach((value, k) => {
      const far = Math.hypot(left + (value - from) / (to - from) * (right - left) - x, bottom - (line.y[k] - low) / (high - low) * (bottom - top) - y);
      if (far < best[0]) best = [far, line.keys[k]];
    });
    if (best[1] !== null) this.onPick(null, best[1], view);
  }

  // by keys: the next point of a scatter; of curves the middle of what is seen
  step(view, by) {
    const keys = view.figure.lines.flatMap(line => line.keys ? [...line.keys] : []).sort((a, b) => a - b);
    if (!keys.length) { const [from, to] = this.across(view); this.onPick((from + to) / 2, null, view); return; }
    const next = keys[(keys.indexOf(this.chosen ?? -1) + by + keys.length) % keys.length];
    this.chosen = next; this.onPick(null, next, view);
  }
}
