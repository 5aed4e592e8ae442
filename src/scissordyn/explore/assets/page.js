// The page: its socket, and what comes through it given to drawing, curves, table, form and bar. All of a run comes in one message
// and is shown in one turn of the browser, so that at every instant all parts have the numbers of one run.
import canvas from "./canvas.js";
import { bar } from "./bar.js";
import { Curves } from "./curves.js";
import { element } from "./element.js";
import { form } from "./form.js";
import { table } from "./table.js";

const part = id => document.getElementById(id);
const socket = new WebSocket(new URL("ws", location.href.replace(/^http/, "ws")));
socket.binaryType = "arraybuffer";
const send = message => {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
  if (["change", "undo", "redo", "open"].includes(message.type)) window.dispatchEvent(new Event("scissordyn:changed"));
};

// see `packed` in serve.py
export function unpack(buffer) {
  const size = new DataView(buffer).getUint32(0, true), head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  let start = 4 + size;
  const arrays = head.arrays.map(([kind, bytes]) => {
    const array = kind === "floats" ? new Float64Array(buffer, start, bytes / 8) : new Uint8Array(buffer, start, bytes);
    start += 8 * Math.ceil(bytes / 8);
    return array;
  });
  const whole = value => {
    if (value === null || typeof value !== "object") return value;
    if ("$" in value) return arrays[value.$];
    for (const key of Object.keys(value)) value[key] = whole(value[key]);
    return value;
  };
  return whole(head.message);
}

// ---- the drawing: canvas.js reads and sets the values of a model
const values = { scene: "", ghost: "", draft: "", selected: "", bends: false }, reactions = {};
const put = changes => {
  for (const [name, value] of Object.entries(changes)) if (value !== undefined && (values[name] !== value || name === "draft")) {
    values[name] = value;
    (reactions[`change:${name}`] || []).forEach(reaction => reaction());
  }
};
canvas.render({
  el: part("sd-canvas"),
  model: {
    get: name => values[name], on: (event, reaction) => (reactions[event] = reactions[event] || []).push(reaction), save_changes: () => {}, send,
    set: (name, value) => { put({ [name]: value }); if (name === "selected") send({ type: "select", name: value }); },
  },
});

const curves = new Curves(part("sd-curves"), { onPick: x => go(x / factor) });
const orbit = new Curves(part("sd-orbit"), { square: 240 });
const contacts = table(part("sd-contacts"), go), numbers = form(part("sd-form"), send), top = bar(part("sd-top"), send, curves);
const [head, scatters] = part("sd-points").children, axis = head.querySelector("select");
const points = new Curves(scatters, { onPick: (x, point) => send({ type: "open", point }) });
axis.onchange = () => send({ type: "axis", name: axis.value });
let factor = 1;
function go(time) { window.dispatchEvent(new CustomEvent("scissordyn:go", { detail: time })); }
window.addEventListener("scissordyn:time", event => curves.move(event.detail * factor));
window.addEventListener("scissordyn:theme", () => { curves.redraw(); orbit.redraw(); points.redraw(); });

const shows = {
  early: message => { if (!values.scene) put({ scene: message.scene }); },
  form: numbers.show,
  influence: numbers.weighed.show,
  state: top.state,
  said: top.said,
  python: message => top.code(message.text),
  points: message => {
    part("sd-points").hidden = false;
    axis.replaceChildren(...message.axes.map(name => new Option(name, name, false, name === message.axis)));
    axis.parentElement.hidden = message.axes.length < 2;
    head.lastElementChild.textContent = message.note;
    points.show(message.figures);
    points.views.forEach(view => { view.range = null; });
  },
  draft: message => put({ draft: message.draft }),
  run: message => {
    const time = curves.cursor / factor;
    factor = message.factor;
    curves.cursor = time * factor;
    curves.show(message.figures, { full: [0, message.until], horizon: message.horizon, run: message.run });
    orbit.show(message.orbit ? [message.orbit] : [], { run: message.run });
    put({ bends: message.bends, ghost: message.ghost, selected: message.selected, scene: message.scene });
    if (message.table) contacts.show(message.table, message.run);
    top.run(message);
    numbers.weighed.run(message);
    window.scissordyn.shown = { ...window.scissordyn.shown, ...message };
    drawn(message.run);
  },
  file: message => {
    const href = URL.createObjectURL(new Blob([message.content], { type: message.mime }));
    element("a", { href, download: message.name }).click();
    setTimeout(() => URL.revokeObjectURL(href), 10000);
  },
};
// the next run is sent when this one has been drawn; in a tab that is not looked at nothing is
function drawn(run) {
  let told = false;
  const tell = () => { if (!told) { told = true; window.scissordyn.drawn = { run, at: performance.now() }; send({ type: "drawn", run }); } };
  requestAnimationFrame(() => setTimeout(tell));
  setTimeout(tell, 500);
}
// for tests and measurements
window.scissordyn = { shown: null, drawn: null, curves, orbit, contacts, points, released: 0 };

socket.onmessage = event => { const message = unpack(event.data); shows[message.type](message); };
socket.onclose = () => top.said({ text: `${top.last || "the explorer has ended or cannot be reached"}; start it again, then open its new address`, final: true });
performance.mark("scissordyn:page");
