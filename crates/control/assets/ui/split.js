// The arm beside the view: how wide it is, by a bar between the two, and whether it is shown. Both are kept by the browser.

import {make, mark, say} from "./dom.js";

const LEAST = 16, MOST = 60, USUAL = 30, STEP = 2;   // rem

const kept = (key, value) => {
  try {
    if (value === undefined) return localStorage.getItem("ts3100." + key);
    localStorage.setItem("ts3100." + key, value);
  } catch { /* a browser may keep nothing */ }
  return undefined;
};

/** Adds the bar and the button to `views`; `show(on)` shows or hides the arm. */
export function createSplit(views, show) {
  const bar = make("div", {id: "split", role: "separator", tabindex: "0", "aria-orientation": "vertical", "aria-label": "Width of the arm", "aria-valuemin": LEAST, "aria-valuemax": MOST, "aria-valuenow": USUAL,
    title: "Drag, or use the arrow keys, to make the arm wider or narrower"});
  const button = make("button", {id: "arm-shown", type: "button", title: "Show or hide the arm", onclick: () => setShown(!shown)});
  const rem = () => parseFloat(getComputedStyle(document.documentElement).fontSize);
  let shown, width;

  function setWidth(wanted) {
    width = Math.min(MOST, Math.max(LEAST, wanted));
    views.style.setProperty("--arm", width + "rem");
    mark(bar, "aria-valuenow", width.toFixed(0));
    kept("arm-width", width);
  }

  function setShown(on) {
    shown = on;
    mark(document.body, "data-arm", on);
    say(button, on ? "Hide arm" : "Show arm");
    kept("arm-shown", on);
    show(on);
  }

  bar.addEventListener("pointerdown", event => bar.setPointerCapture(event.pointerId));
  bar.addEventListener("pointermove", event => { if (bar.hasPointerCapture(event.pointerId)) setWidth((event.clientX - views.getBoundingClientRect().left) / rem()); });
  bar.addEventListener("keydown", event => {
    const step = {ArrowLeft: -STEP, ArrowRight: STEP}[event.key];
    if (!step) return;
    setWidth((width ?? document.getElementById("view-arm").offsetWidth / rem()) + step);
    event.preventDefault();
  });
  views.append(bar);
  document.getElementById("tabs").after(button);
  const before = Number(kept("arm-width"));
  if (before) setWidth(before);
  setShown(kept("arm-shown") !== "false");
}
