// Lengths in the drawing: a scale bar, a grid, and places of the grid for what is dragged; and sizes in words. It stands before canvas.js.

const FAR = 70;  // least length of the scale bar, and twice the distance of lines of the grid [pixel]

// 1, 2 or 5 times a power of ten: the smallest of these lengths that is so many pixels long [m]
function roundLength(scale, pixels = FAR) {
  const least = pixels / scale, power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map(part => part * power).find(length => length >= least * (1 - 1e-9));
}

function meters(length) {
  const [size, unit] = [[1, "m"], [1e-3, "mm"], [1e-6, "µm"]].find(([size]) => length >= size * (1 - 1e-9)) || [1e-9, "nm"];
  return `${Number((length / size).toPrecision(3))} ${unit}`;
}

const gridStep = scale => roundLength(scale, FAR / 2);
const onGrid = (place, scale) => place.map(each => Math.round(each / gridStep(scale)) * gridStep(scale));

// low and high: places of the drawing's lower left and upper right corner [m]
function drawGrid(context, low, high, scale, X, Y, colors) {
  const step = gridStep(scale);
  for (const [axis, at] of [[0, X], [1, Y]]) {
    for (let k = Math.ceil(low[axis] / step); k * step <= high[axis]; k++) {
      const here = at(k * step), ends = axis ? [[X(low[0]), here], [X(high[0]), here]] : [[here, Y(low[1])], [here, Y(high[1])]];
      trace(context, ends, { color: colors.fill, width: k % 5 === 0 ? 1.4 : 0.6 });
    }
  }
}

function drawScaleBar(context, height, scale, text, colors) {
  const length = roundLength(scale), wide = length * scale, [x, y] = [8, height - 8];
  trace(context, [[x, y - 5], [x, y], [x + wide, y], [x + wide, y - 5]], { color: colors.ink, width: 1.4 });
  text(meters(length), x + wide / 2, y - 9, colors.ink);
}

// where something of a size begins, moved so that it is within 0 and an end
function within(start, size, end) { return Math.max(2, Math.min(start, end - size - 2)); }

function newtons(force) {
  for (const [size, unit] of [[1e6, "MN"], [1e3, "kN"], [1, "N"]]) if (force >= size || unit === "N") return `${Number((force / size).toPrecision(3))} ${unit}`;
}

