// The mechanism on a canvas, with a player, for the explorer, films and notebooks. It needs no network; scene.js and ruler.js stand before it.
// In: scene, ghost, draft (JSON, see canvas.py), selected (name of a joint), bends (deflections can be magnified), movable (false:
// no drags). Out: selected, and messages of drags.

const TRAIL = 40;            // frames over which the journal's path stays visible
const REACH = 11;            // how near to a joint a click must be [pixel]
const GAP = 0.35;            // drawn clearance as a fraction of the drawn journal's radius, as in films
const LETTER = "system-ui, sans-serif";
const SMALL = 80;            // side of the drawing of a bearing from which on there is room for its force [pixel]
const HIGH = 15;             // of a name [pixel]
const MOST_NAMES = 6;        // of more joints only the chosen one has its name in the drawing
const TONES = { ink: "#222222", back: "#ffffff", faint: "#767676", fill: "#e4e4e4", blue: "#0072B2", green: "#009E73",
  blueFill: "#b5d3ea", greenFill: "#b0dfcd",
  contact: "#D55E00", free: "#56B4E9", part: "#CC79A7", trail: "#E69F00" };
const GUIDE = [10, 4, 2, 4];  // dashes and gaps of the line of a guide
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4];
const LARGER = [1, 2, 5, 10, 20, 50, 100];  // magnifications of deflections

const STYLE = `
.sd-stage { display: flex; flex-direction: column; height: 100%; min-height: 320px; color: var(--sd-ink, #222);
  font: 13px/1.4 system-ui, sans-serif; background: var(--sd-back, #fff) }
.sd-stage canvas { flex: 1 1 auto; width: 100%; min-height: 260px; touch-action: none; display: block; outline-offset: -2px }
.sd-player { display: flex; flex-wrap: wrap; gap: 6px; align-items: center; padding: 4px 2px }
.sd-player input[type=range] { flex: 1 1 8rem; min-width: 6rem }
.sd-player button, .sd-player select { font: inherit; color: inherit; background: var(--sd-field, #f4f4f4);
  border: 1px solid var(--sd-line, #bbb); border-radius: 4px; padding: 2px 9px; cursor: pointer }
.sd-player button[aria-pressed=true] { border-color: var(--sd-trail, #b87700) }
.sd-player output { min-width: 7.5em; font-variant-numeric: tabular-nums }
.sd-note { min-height: 1.4em; color: var(--sd-faint, #666); padding: 0 2px }
`;

function render({ model, el }) {
  const root = document.createElement("div");
  root.className = "sd-stage";
  root.innerHTML = `<style>${STYLE}</style><canvas tabindex="0" role="img"></canvas>
    <div class="sd-player"><button type="button" data-id="play">Play</button>
    <input type="range" data-id="scrub" min="0" max="1" step="1" value="0" aria-label="time">
    <output data-id="clock"></output>
    <label>speed <select data-id="speed" aria-label="speed"></select></label>
    <label data-id="deflections" hidden>deflections <select data-id="magnify" aria-label="magnification of deflections"></select></label>
    <label hidden>bars <select data-id="bars" aria-label="what is drawn on bars"></select></label>
    <button type="button" data-id="fit" title="show all; also by a double click">Fit</button>
    <button type="button" data-id="grid" aria-pressed="false" title="lines of equal distance; joints are dragged from one to the next">Grid</button></div>
    <div class="sd-note" data-id="note" role="status"></div>`;
  el.append(root); el.style.height = "100%";
  const part = id => root.querySelector(`[data-id=${id}]`);
  const canvas = root.querySelector("canvas"), context = canvas.getContext("2d");
  const [button, scrub, clock, speed, note, magnify, bars] = ["play", "scrub", "clock", "speed", "note", "magnify", "bars"].map(part);
  for (const s of SPEEDS) speed.add(new Option(`${s}×`, s, s === 1, s === 1));
  for (const s of [...LARGER, "auto"]) magnify.add(new Option(s === "auto" ? s : `${s}×`, s, s === 1, s === 1));

  const movable = model.get("movable") !== false;  // whether somebody assembles what is dragged
  let scene = null, ghost = null, draft = null, colors = {};
  let now = 0, gridded = false, playing = false, before = null, wanted = false, hover = null, pointer = null, hold = null, drawn = 0, named = [];
  const camera = { x: 0, y: 0, scale: 1, own: false };

  // ---- colours: from the page's theme, with defaults for notebooks
  function recolor() {
    const style = getComputedStyle(root), of = ([name, other]) => [name, style.getPropertyValue(`--sd-${name}`).trim() || other];
    colors = Object.fromEntries(Object.entries(TONES).map(of));
  }

  // ---- geometry
  const frames = () => scene ? scene.time.length : 0;
  const box = () => {
    const width = canvas.clientWidth, height = canvas.clientHeight, count = scene ? scene.insets.length : 0;
    if (!count) return { width, height, main: width, cell: 0, columns: 0 };
    const room = height - 18;  // below stands how much they are magnified
    // as many columns as make them largest
    let cell = 0, columns = 1;
    for (let tried = 1; tried <= count; tried++) {
      const side = Math.min(132, room / Math.ceil(count / tried), 0.45 * width / tried);
      if (side > cell * 1.001) [cell, columns] = [side, tried];
    }
    return { width, height, main: width - columns * cell, cell, columns };
  };
  function fit() {
    if (!scene) return;
    const { main, height } = box(), [x0, y0] = scene.low, [x1, y1] = scene.high;
    const view = (left, right) => {
      camera.scale = 0.96 * Math.min((main - left - right) / (x1 - x0), height / (y1 - y0));
      camera.x = (x0 + x1) / 2 - (left - right) / 2 / camera.scale;
    };
    camera.y = (y0 + y1) / 2; camera.own = false; view(0, 0); view(...beyond(main));
  }
  // how far names leave the drawing at its sides during the run [pixel], at most a sixth of it at each
  function beyond(main) {
    let left = 0, right = 0; context.font = `12px ${LETTER}`;
    for (const inset of scene.insets) {
      if (!inset.block && scene.joints.length > MOST_NAMES) continue;
      const wide = context.measureText(inset.name).width, step = Math.max(1, Math.floor(frames() / 20));
      for (let frame = 0; frame < frames(); frame += step) {
        const x = main / 2 + (at(inset.place, frame, 0, 1)[0] - camera.x) * camera.scale + inset.aside(frame)[0];
        left = Math.max(left, wide / 2 - x); right = Math.max(right, x + wide / 2 - main);
      }
    }
    return [left, right].map(each => Math.min(each, main / 6));
  }
  function onto() {
    const { main, height } = box(), followed = followedPlace();
    const cx = followed ? followed[0] : camera.x, cy = followed ? followed[1] : camera.y;
    return [(x) => main / 2 + (x - cx) * camera.scale, (y) => height / 2 - (y - cy) * camera.scale];
  }
  // the place in the mechanism of a point of the drawing
  function placeOf(x, y) {
    const [X, Y] = onto();
    return [(x - X(0)) / camera.scale, (Y(0) - y) / camera.scale];
  }
  function places(source, frame) {
    const found = source.pins.names.map((name, k) => ({ name, loose: false, at: at(source.pins.points, frame, k, source.pins.names.length) }));
    for (const joint of source.joints) found.push({ name: joint.name, loose: true, at: at(joint.place, frame, 0, 1) });
    return found;
  }
  const shown = () => draft || scene;
  const frameOf = () => draft ? 0 : Math.min(frames() - 1, Math.floor(now));
  function followedPlace() {
    const name = model.get("selected");
    if (!camera.own || !camera.follow || !name || !scene) return null;
    const source = shown(), found = places(source, frameOf()).find(each => each.name === name);
    if (found) return found.at;
    const channel = source.channels.find(each => each.joint === name);
    return channel ? at(channel.place, frameOf(), 0, 1) : null;
  }

  // ---- drawing
  function line(points, frame, n, X, Y, closed) {
    context.beginPath();
    for (let k = 0; k < n; k++) { const [x, y] = at(points, frame, k, n); k ? context.lineTo(X(x), Y(y)) : context.moveTo(X(x), Y(y)); }
    if (closed) context.closePath();
  }
  function drawShapes(source, frame, X, Y, faint) {
    for (const shape of source.shapes) {
      const solid = shape.kind === "bar" || shape.kind === "plate", load = shape.kind === "payload", closed = load || ["plate", "block", "panel"].includes(shape.kind);
      context.setLineDash(shape.kind === "guide" ? GUIDE : shape.kind === "rod" || faint ? [6, 3] : []);
      context.lineWidth = faint ? 1.2 : { bar: 6, plate: 2.4, block: 1.2, payload: 1.2, panel: 0.8, component: 1.4, rod: 1.8, guide: 1 }[shape.kind];
      context.strokeStyle = faint ? colors.faint : shape.kind === "guide" ? colors.faint : solid ? (shape.tone ? colors.green : colors.blue)
        : shape.kind === "block" || load ? colors.ink : colors.part;
      if (faint && !solid) continue;
      context.lineCap = shape.kind === "bar" ? "round" : "butt";
      line(shape.points, frame, shape.count, X, Y, closed);
      if (!faint && closed) {
        context.save(); context.globalAlpha = { plate: 0.15, panel: 0.25, payload: 0.45 }[shape.kind] || 1;
        context.fillStyle = shape.kind === "block" ? colors.fill : load ? colors.faint : context.strokeStyle; context.fill(); context.restore();
      }
      context.stroke();
      if (shape.kind === "bar" && !faint) {  // a bar has an outline and a lighter inside
        context.lineWidth = 4.2; context.strokeStyle = shape.tone ? colors.greenFill : colors.blueFill; context.stroke();
      }
    }
    context.setLineDash([]);
  }
  function disc(x, y, r, fill, stroke, width) {
    context.beginPath(); context.arc(x, y, r, 0, 2 * Math.PI);
    if (fill) { context.fillStyle = fill; context.fill(); }
    if (stroke) { context.strokeStyle = stroke; context.lineWidth = width; context.stroke(); }
  }
  function text(words, x, y, color, align = "center", size = 12, most = undefined) {
    context.font = `${size}px ${LETTER}`; context.textAlign = align; context.textBaseline = "middle";
    context.lineWidth = 3; context.strokeStyle = colors.back; context.strokeText(words, x, y, most);
    context.fillStyle = color; context.fillText(words, x, y, most);
  }
  // the name of a point of the drawing, moved into the drawing where it would leave it; that of a point outside is not drawn
  function name(words, x, y, dx, dy, color, align = "center") {
    const { main, height } = box(); if (x < 0 || x > main || y < 0 || y > height) return;
    context.font = `12px ${LETTER}`;
    const wide = context.measureText(words).width, wished = x + dx - (align === "left" ? 0 : wide / 2), left = within(wished, wide, main);
    if (Math.abs(left - wished) > 8) dy = dy > 0 ? 22 : -22;  // beside it there is no room
    const top = within(y + dy - HIGH / 2, HIGH, height);
    named.push({ words, left, top, right: left + wide, bottom: top + HIGH });
    const nx = Math.max(left, Math.min(x, left + wide)), ny = Math.max(top, Math.min(y, top + HIGH)), part = 6 / Math.hypot(nx - x, ny - y);
    if (part < 0.7) trace(context, [[nx, ny], [x + (nx - x) * part, y + (ny - y) * part]], { color, width: 0.6 });  // to a point further off
    text(words, left, top + HIGH / 2, color, "left");
  }
  function drawPath(points, first, last, X, Y, width) {
    const places = [];
    for (let k = first; k <= last; k++) { const [x, y] = at(points, k, 0, 1); places.push([X(x), Y(y)]); }
    trace(context, places, { color: colors.trail, width });
  }
  function drawTracks(source, frame, X, Y) {
    for (const track of source.tracks) {
      drawPath(track.points, 0, frame, X, Y, 1.2);
      const [x, y] = at(track.points, frame, 0, 1);
      disc(X(x), Y(y), 3, colors.trail); name(track.name, X(x), Y(y), 8, -9, colors.trail, "left");
    }
  }
  function drawJoints(source, frame, X, Y) {
    for (const [x, y] of source.supports) {
      const s = 9, [left, right] = [-s, s].map(aside => [X(x) + aside, Y(y) + 1.6 * s]);
      trace(context, [[X(x), Y(y)], left, right], { color: colors.ink, width: 1.2, fill: colors.back });
    }
    const selected = model.get("selected");
    for (const each of places(source, frame)) {
      const [x, y] = [X(each.at[0]), Y(each.at[1])];
      if (!each.loose) disc(x, y, 4, colors.back, colors.ink, 1.2);
      if (each.name === selected) disc(x, y, 13, null, colors.trail, 2);
    }
    const ring = ringRadius(source, frame, camera.scale);
    for (const joint of source.joints) {
      const [x, y] = at(joint.place, frame, 0, 1), color = joint.touched[frame] ? colors.contact : colors.free;
      disc(X(x), Y(y), ring, null, color, 2.2 * Math.sqrt(ring / RING));
      if (source.joints.length <= MOST_NAMES || joint.name === selected) name(joint.name, X(x), Y(y), ...joint.aside(frame), colors.ink);
    }
    for (const channel of source.channels) {
      const [x, y] = at(channel.place, frame, 0, 1);
      disc(X(x), Y(y), ring, null, touches(channel, frame) ? colors.contact : colors.free, 2.2);
      name(channel.name, X(x), Y(y), ...channel.aside(frame), colors.ink);
    }
    if (hover && hover.kind === "pin") name(hover.name, hover.x, hover.y, 0, -17, colors.ink);
    if (hover && hover.kind === "length") {
      context.save(); context.translate(hover.x, hover.y); context.rotate(Math.PI / 4);
      context.fillStyle = colors.trail; context.fillRect(-5, -5, 10, 10); context.restore();
      name(`${hover.name}: drag its length`, hover.x, hover.y, 0, -17, colors.ink);
    }
  }
  function touches(channel, frame) {
    return channel.touching.subarray(frame * channel.count, (frame + 1) * channel.count).some(Boolean);
  }
  function drawBearing(joint, frame, cx, cy, r, color) {
    disc(cx, cy, (1 + GAP) * r, colors.back, joint.name === model.get("selected") ? colors.trail : colors.ink, 1.4);
    const [x, y] = at(joint.journal, frame, 0, 1);
    disc(cx + r * x, cy - r * y, r, colors.fill, color, 2.4);
    drawPath(joint.journal, Math.max(0, frame - TRAIL), frame, u => cx + r * u, v => cy - r * v, 1.3);
    disc(cx, cy, 1.5, colors.ink);
  }
  function drawChannel(channel, frame, cx, cy, r, color) {
    const long = channel.edge * r, level = (height, look) => trace(context, [[cx - long, cy - height], [cx + long, cy - height]], look);
    for (const [side, height] of channel.surfaces) {
      const deep = channel.hollow ? -2 * height * side : 0.25;  // a pole is solid, a channel has a strip on each side
      context.fillStyle = colors.fill; context.fillRect(cx - long, cy - r * Math.max(height, height + deep * side), 2 * long, deep * r);
      level(r * height, { color: channel.joint === model.get("selected") ? colors.trail : colors.ink, width: 1.4 });
    }
    level(0, { color: colors.faint, width: 0.8, dash: GUIDE });
    context.setLineDash([]);
    if (channel.hollow) {  // the inner sides of a ring, above and below its pole
      const middle = channel.surfaces.reduce((sum, [, height]) => sum + height, 0) / 2;
      const corners = Array.from({ length: channel.count }, (_, k) => at(channel.block, frame, k, channel.count));
      for (const side of [1, -1]) {
        const own = corners.filter(([, y]) => Math.sign(y - middle) === side);
        const ends = own.length > 1 ? own : own.flatMap(([x, y]) => [[x - 0.5, y], [x + 0.5, y]]);
        trace(context, ends.map(([x, y]) => [cx + r * x, cy - r * y]), { color, width: 2.4 });
      }
    } else {
      line(channel.block, frame, channel.count, x => cx + r * x, y => cy - r * y, true);
      context.fillStyle = colors.fill; context.fill();
      context.strokeStyle = color; context.lineWidth = 2.4; context.stroke();
    }
    for (let k = 0; k < channel.count; k++) if (channel.touching[frame * channel.count + k]) {
      const [x, y] = at(channel.block, frame, k, channel.count);
      disc(cx + r * x, cy - r * y, 4, colors.contact);
    }
  }
  function drawInsets(source, frame) {
    const { main, cell, columns, height } = box();
    if (!columns || !source.insets.length) return;  // what is dragged has ideal joints
    source.insets.forEach((joint, k) => {
      const cx = main + (k % columns + 0.5) * cell, cy = (Math.floor(k / columns) + 0.5) * cell;
      if (cy > height) return;
      const touched = joint.block ? touches(joint, frame) : joint.touched[frame], color = touched ? colors.contact : colors.free;
      const small = cell < SMALL, up = small ? 6 : 12;  // small ones say their force by their colour alone
      (joint.block ? drawChannel : drawBearing)(joint, frame, cx, cy - up, (small ? 0.22 : 0.25) * cell, color);
      let size = 12, words = joint.name;
      const wide = () => { context.font = `${size}px ${LETTER}`; return context.measureText(words).width; };
      while (size > 9 && wide() > cell - 3) size--;
      while (words.length > 6 && wide() > 1.15 * cell) words = `${words.slice(0, -2)}…`;  // a little is condensed
      text(words, cx, cy + cell / 2 - (small ? 7 : 18), colors.ink, "center", size, cell - 3);
      if (!small) text(touched ? newtons(joint.force[frame]) : "free", cx, cy + cell / 2 - 5, touched ? colors.contact : colors.faint);
    });
    const gains = [...new Set(source.insets.map(joint => Number(joint.gain.toPrecision(2))))];
    text(`clearance magnified ${gains.length > 1 ? `${Math.min(...gains)} to ${Math.max(...gains)}` : gains[0]} times`,
      main + columns * cell - 4, height - 8, colors.faint, "right");
  }
  function draw() {
    wanted = false;
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width || !height) return;
    const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (canvas.width !== wide || canvas.height !== high) { [canvas.width, canvas.height] = [wide, high]; if (!camera.own) fit(); }
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = colors.back; context.fillRect(0, 0, width, height);
    if (!scene) { text("computing the first run", width / 2, height / 2, colors.faint); return; }
    const source = shown(), frame = frameOf(), [X, Y] = onto(); named = [];
    hover = pointer && !hold ? hit(...pointer) : null; canvas.style.cursor = hover ? "pointer" : "grab";  // below it the drawing moves
    context.save(); context.beginPath(); context.rect(0, 0, box().main, height); context.clip();
    if (scene.horizon !== null && scene.time[frame] > scene.horizon) {
      context.fillStyle = colors.fill; context.globalAlpha = 0.45; context.fillRect(0, 0, width, height); context.globalAlpha = 1;
      text("beyond predictability horizon", box().main / 2, 14, colors.faint);
    }
    if (gridded) drawGrid(context, placeOf(0, height), placeOf(box().main, 0), camera.scale, X, Y, colors);
    if (ghost && !draft) drawShapes(ghost, Math.min(ghost.time.length - 1, nearest(ghost, scene.time[frame])), X, Y, true);
    drawShapes(source, frame, X, Y, false);
    drawDiagram(context, source, bars.value, frame, X, Y, text, colors);
    drawTracks(source, frame, X, Y);
    drawJoints(source, frame, X, Y);
    if (source.magnification !== 1) text(`deflections ${source.magnification}×`, 8, 14, colors.ink, "left");
    drawScaleBar(context, height, camera.scale, text, colors);
    context.restore();
    drawInsets(source, frame);
    canvas.dataset.drawn = ++drawn; canvas.dataset.frame = frame;
  }
  function nearest(source, time) {
    const last = source.time[source.time.length - 1];
    return last > 0 ? Math.max(0, Math.round(time / last * (source.time.length - 1))) : 0;
  }
  function redraw() { if (!wanted) { wanted = true; requestAnimationFrame(draw); } }

  // ---- time
  function show(broadcast = true) {
    if (!scene) return;
    const frame = frameOf(), t = scene.time[frame];
    scrub.value = frame;
    clock.textContent = `t = ${Number((scene.timeScale * t).toPrecision(4))} ${scene.timeUnit}`;
    redraw();
    if (broadcast) window.dispatchEvent(new CustomEvent("scissordyn:time", { detail: t }));
  }
  function play(on) {
    playing = on && frames() > 1; before = null;
    button.textContent = playing ? "Pause" : "Play";
    if (playing) { if (now >= frames() - 1) now = 0; requestAnimationFrame(step); } else show();
  }
  function step(instant) {
    if (!playing) return;
    if (before !== null) now += (instant - before) / 1000 * (frames() - 1) / scene.seconds * Number(speed.value);
    before = instant;
    if (now >= frames() - 1) { now = frames() - 1; play(false); return; }
    show();
    requestAnimationFrame(step);
  }
  function go(frame) { play(false); now = Math.min(frames() - 1, Math.max(0, frame)); show(); }
  function goto(t) { if (scene) go(Math.round(t / (scene.time[frames() - 1] || 1) * (frames() - 1))); }

  // ---- pointer
  const where = ({ clientX, clientY }) => { const r = canvas.getBoundingClientRect(); return [clientX - r.left, clientY - r.top]; };
  // the handle of the length of a bar
  function grip(shape, frame, X, Y) {
    const [a, b] = [at(shape.points, frame, 0, 2), at(shape.points, frame, 1, 2)];
    return [X(0.65 * a[0] + 0.35 * b[0]), Y(0.65 * a[1] + 0.35 * b[1])];
  }
  function hit(px, py) {
    if (!scene) return null;
    const { main, cell, columns } = box(), source = shown(), frame = frameOf(), [X, Y] = onto();
    if (columns && px > main) {
      const k = Math.floor((px - main) / cell) + columns * Math.floor(py / cell);
      const inset = source.insets[k];
      return inset ? { kind: "inset", name: inset.joint || inset.name } : null;
    }
    let best = null;
    for (const each of places(source, frame)) {
      const [x, y] = [X(each.at[0]), Y(each.at[1])], far = Math.hypot(px - x, py - y);
      if (far < REACH && (!best || far < best.far || (each.loose && far < best.far + 3))) best = { kind: "pin", name: each.name, x, y, far };
    }
    for (const shape of source.shapes) {
      if (best || shape.kind !== "bar" || shape.count !== 2 || !movable) continue;
      const [x, y] = grip(shape, frame, X, Y);
      if (Math.hypot(px - x, py - y) < REACH) return { kind: "length", name: shape.name, x, y };
    }
    return best;
  }
  function select(name) { model.set("selected", name); model.save_changes(); redraw(); }
  // the next clearance joint or guide, as they stand beside the drawing
  function turn(by) {
    const names = scene ? scene.insets.map(inset => inset.joint || inset.name) : [], now = names.indexOf(model.get("selected"));
    const next = names[now < 0 ? 0 : (now + by + names.length) % names.length];
    if (next) { note.textContent = `Chosen: ${next}.`; select(next); }
  }
  // a move is sent when the one before has been answered, so that the drawing is never behind a queue of moves
  let queued = null, asked = false;
  function flush() { if (queued && !asked) { asked = true; model.send(queued); queued = null; } }
  function tell(phase) {
    const message = { type: "drag", kind: hold.kind, name: hold.name, dx: hold.dx, dy: hold.dy, phase };
    if (phase === "move") { queued = message; flush(); return; }
    queued = null; asked = phase === "start"; model.send(message);
  }
  canvas.addEventListener("pointerdown", event => {
    const [x, y] = where(event), found = hit(x, y);
    canvas.setPointerCapture(event.pointerId); canvas.focus();
    const pin = found || { kind: "pan" };
    hold = { ...pin, pinX: pin.x, pinY: pin.y, lastX: x, lastY: y, moved: false, dx: 0, dy: 0, px: x, py: y };
  });
  canvas.addEventListener("pointermove", event => {
    const [x, y] = where(event);
    if (!hold) {
      pointer = [x, y];
      if (JSON.stringify(hit(x, y)) !== JSON.stringify(hover)) redraw();
      return;
    }
    if (!hold.moved && Math.hypot(x - hold.px, y - hold.py) < 4) return;
    if (!hold.moved) {
      hold.moved = true;
      if (hold.kind === "pin" && !movable) hold.kind = "pan";
      if (hold.kind === "pin" || hold.kind === "length") { go(0); tell("start"); }
    }
    if (hold.kind === "pan") {
      const followed = followedPlace();
      if (followed) [camera.x, camera.y] = followed;
      camera.x -= (x - hold.lastX) / camera.scale; camera.y += (y - hold.lastY) / camera.scale; camera.own = true; camera.follow = false;
      redraw();
    } else if (hold.kind !== "inset") {
      [hold.dx, hold.dy] = [(x - hold.px) / camera.scale, (hold.py - y) / camera.scale];
      if (gridded && hold.kind === "pin") {
        const [fromX, fromY] = placeOf(hold.pinX, hold.pinY), [toX, toY] = onGrid([fromX + hold.dx, fromY + hold.dy], camera.scale);
        [hold.dx, hold.dy] = [toX - fromX, toY - fromY];
      }
      tell("move");
    }
    hold.lastX = x; hold.lastY = y;
  });
  function release() {
    if (!hold) return;
    if (hold.moved && (hold.kind === "pin" || hold.kind === "length")) tell("end");
    else if (!hold.moved && (hold.kind === "pin" || hold.kind === "inset")) {
      const again = model.get("selected") === hold.name && camera.follow, seen = followedPlace();
      camera.follow = !again; camera.own = true;
      if (again && seen) [camera.x, camera.y] = seen;
      select(hold.name);
      note.textContent = camera.follow ? `The view follows joint ${hold.name}; click it again, or Fit, to let it go.` : "";
      redraw();
    }
    hold = null;
  }
  canvas.addEventListener("pointerleave", () => { pointer = null; redraw(); });
  for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, release);
  canvas.addEventListener("wheel", event => {
    event.preventDefault();
    const [x, y] = where(event), { main, height } = box(), factor = Math.exp(-0.0015 * event.deltaY), seen = followedPlace();
    if (!seen) {
      const wx = camera.x + (x - main / 2) / camera.scale, wy = camera.y - (y - height / 2) / camera.scale;
      camera.x = wx - (x - main / 2) / (camera.scale * factor); camera.y = wy + (y - height / 2) / (camera.scale * factor);
    }
    camera.scale *= factor; camera.own = true; redraw();
  }, { passive: false });
  const refit = () => { camera.follow = false; note.textContent = ""; fit(); redraw(); };
  canvas.addEventListener("dblclick", refit); part("fit").addEventListener("click", refit);
  button.addEventListener("click", () => play(!playing));
  part("grid").addEventListener("click", event => {
    gridded = !gridded; event.currentTarget.setAttribute("aria-pressed", String(gridded)); redraw();
  });
  magnify.addEventListener("change", () => {
    model.send({ type: "magnify", factor: magnify.value === "auto" ? "auto" : Number(magnify.value) });
    note.textContent = magnify.value === "1" ? "" : "Deflections are being magnified.";
  });
  bars.addEventListener("change", redraw); scrub.addEventListener("input", () => go(Number(scrub.value)));
  const keys = { " ": () => play(!playing), ArrowLeft: () => go(Math.floor(now) - 1), ArrowRight: () => go(Math.floor(now) + 1),
    ArrowUp: () => turn(-1), ArrowDown: () => turn(1) };
  canvas.addEventListener("keydown", event => { if (keys[event.key]) { event.preventDefault(); keys[event.key](); } });

  root.frame = go;
  // where joints and the handles of lengths are on the screen, for tests and other scripts
  root.handles = () => {
    const source = shown(), frame = frameOf(), [X, Y] = onto(), found = {};
    if (!source) return found;
    for (const shape of source.shapes) if (shape.kind === "bar" && shape.count === 2) found[`length ${shape.name}`] = grip(shape, frame, X, Y);
    for (const each of places(source, frame)) found[each.name] = [X(each.at[0]), Y(each.at[1])];
    return found;
  };

  // the names in the drawing with their boxes, and its size, for tests
  root.names = () => ({ width: box().main, height: box().height, boxes: named });

  // whether the whole motion is in the drawing
  const seen = source => {
    const { main, height } = box(), [X, Y] = onto(), [x0, x1] = [X(source.low[0]), X(source.high[0])], [y0, y1] = [Y(source.high[1]), Y(source.low[1])];
    return x0 > -1 && y0 > -1 && x1 < main + 1 && y1 < height + 1;
  };

  // ---- the model
  function newScene() {
    const earlier = scene, whole = !earlier || seen(earlier), phase = earlier && frames() > 1 ? now / (frames() - 1) : 0;
    scene = unpacked(model.get("scene")); draft = null;
    if (scene) {
      scrub.max = frames() - 1;
      now = Math.min(frames() - 1, phase * (frames() - 1));
      if (!camera.own || !earlier) fit();
      else if (whole && !camera.follow && !seen(scene)) note.textContent = "Part of the mechanism is outside the drawing: Fit shows all.";
      canvas.setAttribute("aria-label", `the mechanism: ${scene.pins.names.length} ideal joints, ${scene.joints.length} clearance joints`
        + (scene.channels.length ? `, ${scene.channels.length} clearance guides` : "")
        + "; arrow keys: left and right frames, up and down clearance joints; space: play");
      offer(bars, scene, earlier ? bars.value : scene.onBars);
      canvas.dataset.run = scene.run; canvas.dataset.magnified = scene.magnification;
      if (scene.magnification !== 1) note.textContent = "";
      show(false);
    }
    redraw();
  }
  const changed = {
    scene: newScene,
    ghost: () => { ghost = unpacked(model.get("ghost")); redraw(); },
    draft: () => {
      draft = unpacked(model.get("draft"));
      if (draft) note.textContent = draft.note + (seen(draft) ? "" : "; part of it is outside the drawing");
      asked = false; flush(); redraw();
    },
    selected: redraw,
    bends: () => { part("deflections").hidden = !model.get("bends"); },
    theme: () => { recolor(); redraw(); },
  };
  for (const [name, reaction] of Object.entries(changed)) model.on(`change:${name}`, reaction);
  const events = {
    go: event => goto(event.detail), theme: () => requestAnimationFrame(changed.theme),
    changed: () => { if (!hold) note.textContent = ""; },  // what was dragged is not what is shown any more
  };
  for (const [name, reaction] of Object.entries(events)) window.addEventListener(`scissordyn:${name}`, reaction);
  const size = new ResizeObserver(() => { if (!camera.own) fit(); redraw(); });
  size.observe(canvas); recolor();
  changed.ghost(); newScene(); changed.draft(); changed.bends();
  return () => {
    playing = false; size.disconnect();
    for (const [name, reaction] of Object.entries(events)) window.removeEventListener(`scissordyn:${name}`, reaction);
  };
}

export default { render };
