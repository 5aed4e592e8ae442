// An element of a kind with properties or attributes, and texts and elements in it.
export function element(kind, properties = {}, ...inside) {
  const it = document.createElement(kind);
  for (const [name, value] of Object.entries(properties)) if (name in it) it[name] = value; else it.setAttribute(name, value);
  it.append(...inside);
  return it;
}
