// A number of a table as text, see numeral.py, which says the same: three significant digits or more, trailing zeros kept.
const LEAST_FIGURES = 3, MOST_PLACES = 7;

export function numeral(value, places = 0) {
  if (!Number.isFinite(value)) return "-";
  if (value === 0) return (0).toFixed(Math.min(places, MOST_PLACES));
  const exponent = exponentOf(value), wanted = Math.max(places, LEAST_FIGURES - 1 - exponent, 0);
  if (wanted <= MOST_PLACES && exponent < MOST_PLACES) return value.toFixed(wanted);
  return value.toExponential(LEAST_FIGURES - 1).replace("e+", "e");
}

function exponentOf(value) {
  return Number(value.toExponential(20).split("e")[1]);
}
