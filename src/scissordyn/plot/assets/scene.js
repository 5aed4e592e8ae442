// A scene as it comes from canvas.py, with its arrays unpacked. It stands before canvas.js.

const LETTERS = 1.5;         // size of the letters, over that for which the places of names were chosen
const ABOVE = [0, 15];       // place of a name that is drawn alone, beyond the ring of the chosen joint

const ARRAYS = { shapes: ["points"], joints: ["place", "journal", "touched", "force"], channels: ["place", "block", "touching", "force"],
  diagrams: ["values"], tracks: ["points"] };

function floats(text, Kind = Float32Array) {
  const raw = atob(text), bytes = new Uint8Array(raw.length);
  for (let k = 0; k < raw.length; k++) bytes[k] = raw.charCodeAt(k);
  return new Kind(bytes.buffer);
}

// a point of n at a frame
const at = (points, frame, k, n) => { const i = 2 * (frame * n + k); return [points[i], points[i + 1]]; };

const RING = 8;              // radius of the ring around a clearance joint, where there is room [pixel]

// a line through places of the drawing [pixel], over the area that it encloses where that is filled
function trace(context, places, { color, width = 1, fill, dash = [] }) {
  context.beginPath(); context.setLineDash(dash);
  for (const [x, y] of places) context.lineTo(x, y);
  if (fill) { context.closePath(); context.fillStyle = fill; context.fill(); }
  if (color) { context.strokeStyle = color; context.lineWidth = width; context.stroke(); }
}

// so that bars are seen between rings; joints in one place do not count
function ringRadius(source, frame, scale) {
  const places = source.insets.map(each => at(each.place, frame, 0, 1));
  let nearest = Infinity;
  places.forEach(([x, y], k) => places.slice(0, k).forEach(([u, v]) => {
    const apart = scale * Math.hypot(x - u, y - v);
    if (apart > 1) nearest = Math.min(nearest, apart);
  }));
  return Math.max(2.5, Math.min(RING, nearest / 4));
}

function unpacked(text) {
  if (!text) return null;
  const scene = JSON.parse(text);
  scene.time = floats(scene.time);
  scene.pins.points = floats(scene.pins.points);
  for (const [parts, names] of Object.entries(ARRAYS)) {
    for (const part of scene[parts]) for (const name of names) part[name] = floats(part[name], name.startsWith("touch") ? Uint8Array : Float32Array);
  }
  scene.insets = [...scene.channels, ...scene.joints];
  const looks = scene.asides.length - 1, last = Math.max(1, scene.time.length - 1);
  scene.insets.forEach((inset, k) => {
    inset.aside = frame => (scene.asides[Math.round(frame / last * looks)][k] || ABOVE).map((part, axis) => (axis ? -1 : 1) * LETTERS * part);
  });
  return scene;
}

