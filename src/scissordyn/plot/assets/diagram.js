// What bars that bend carry, drawn on them: stresses as their colours, moments and axial forces as ordinates across them.

const SPAN = 8;              // intervals of the axis of an element, or of a span of a bar, see stroke.py

// for each part of a bar: its index among all parts, and the first and the last of its points in the shape
function partsOf(shape) {
  const spans = shape.count / (SPAN + 1), each = shape.parts.length / spans, step = SPAN / each;
  return shape.parts.map((part, k) => { const first = Math.floor(k / each) * (SPAN + 1) + k % each * step; return [part, first, first + step]; });
}

function drawDiagram(context, source, quantity, frame, X, Y, text, colors) {
  const diagram = source.diagrams.find(each => each.quantity === quantity);
  if (!diagram) return;
  const total = source.shapes.reduce((sum, shape) => sum + shape.parts.length, 0);
  const longest = diagram.ordinate * Math.max(...source.high.map((high, axis) => high - source.low[axis]));
  const line = (points, look) => trace(context, points.map(([x, y]) => [X(x), Y(y)]), look);
  for (const shape of source.shapes) {
    const inner = [], outer = [];
    for (const [part, first, last] of partsOf(shape)) {
      const points = [];
      for (let k = first; k <= last; k++) points.push(at(shape.points, frame, k, shape.count));
      const values = [0, 1].map(end => diagram.values[2 * (frame * total + part) + end]);
      if (!longest) {
        const share = Math.max(...values) / diagram.largest * (diagram.ramp.length - 1);
        line(points, { color: diagram.ramp[Math.round(share)], width: 4 });
        continue;
      }
      inner.push(...points);
      outer.push([[points[0], points[0], points[1]], [points[points.length - 1], ...points.slice(-2)]].map(([place, from, to], end) => {
        const [x, y] = [to[0] - from[0], to[1] - from[1]], size = longest * values[end] / diagram.largest / Math.hypot(x, y);
        return [place[0] + size * y, place[1] - size * x];
      }));
    }
    if (!inner.length) continue;
    const ends = outer.flat();
    context.save(); context.globalAlpha = 0.3;
    line([...inner, ...[...ends].reverse()], { fill: diagram.ramp[0] });  // one area for all parts: between two there would be a seam
    context.restore();
    line(ends, { color: diagram.ramp[0], width: 1.2 });
    line(inner, { color: colors.ink, width: 3.2 });
  }
  drawKey(context, diagram, source.magnification === 1 ? 14 : 32, text, colors);
}

// the choice of a diagram: what the scene knows, with that of before
function offer(select, scene, wished) {
  const known = scene.diagrams.map(each => each.quantity);
  select.replaceChildren(...["", ...known].map(each => new Option(each || "plain", each, false, each === wished)));
  select.parentElement.hidden = !known.length;
}

// what the diagram is, with a colour bar from zero to its largest value
function drawKey(context, diagram, y, text, colors) {
  text(diagram.label, 8, y, colors.ink, "left");
  if (diagram.ordinate) return;
  const wide = 5;
  diagram.ramp.forEach((color, k) => { context.fillStyle = color; context.fillRect(8 + wide * k, y + 10, wide + 0.5, 9); });
  text("0", 8, y + 29, colors.ink, "left");
  text(`${Number((diagram.factor * diagram.largest).toPrecision(3))}`, 8 + wide * diagram.ramp.length, y + 29, colors.ink, "right");
}

