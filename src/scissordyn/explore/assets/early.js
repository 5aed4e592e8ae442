// The mechanism in the frame of the page while the page's libraries are on their way; it goes when the page shows a run.
const shownAlready = () => Boolean((window.scissordynShown || {}).scene);
if (!shownAlready()) {
  const place = document.createElement("div"), reactions = {};
  place.id = "sd-early";
  place.style.cssText = "grid-area: canvas; min-width: 0; min-height: 0; z-index: 1";
  document.getElementById("sd-page").append(place);
  let scene = FIRST;
  const model = {
    get: name => name === "scene" ? scene : name === "movable" ? false : "",
    set: () => {}, save_changes: () => {}, send: () => {}, on: (event, reaction) => { reactions[event] = reaction; },
  };
  const end = render({ model, el: place });
  const leave = event => {
    if (event && !event.detail.scene) return;
    window.removeEventListener("scissordyn:shown", leave);
    if (typeof end === "function") end();
    place.remove();
  };
  window.addEventListener("scissordyn:shown", leave);
  fetch("motion.json").then(answer => answer.text()).then(motion => {
    if (!motion || !place.isConnected) return;
    scene = motion;
    reactions["change:scene"]();
    place.dataset.moves = "true";
  }).catch(() => {});  // the page says what is wrong
}
