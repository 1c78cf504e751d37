// Makes elements, formats values, and shows why a call was refused. No view needs more of the DOM than this.

/** Whether the page shows a recorded run, which `ts3100 view` serves, or which is in the page itself. */
const {recorded} = document.documentElement.dataset;
export const EMBEDDED = recorded === "embedded";
/** Why nothing can be changed; empty on the page of a robot. */
export const LOCKED = recorded ? "this is a recorded run, and nothing in it can be changed" : "";

/** A module of the page, when it is first needed. In a page of one file it may come after this one. */
export async function load(name) {
  await undefined;
  return import("./" + name);
}

/** The styles of a view, when they are first needed. */
export function loadStyle(name) {
  if (EMBEDDED) return Promise.resolve();
  const style = make("link", {rel: "stylesheet", href: "ui/" + name}), styled = new Promise(done => { style.onload = style.onerror = done; });
  document.head.append(style);
  return styled;
}

/** An element: `make("button", {class: "big", onclick: f}, "START")`. Properties that are undefined are left out. */
export function make(name, properties = {}, ...children) {
  const element = document.createElement(name);
  set(element, properties);
  element.append(...children.filter(child => child !== undefined && child !== null));
  return element;
}

/** The same in SVG. */
export function makeSvg(name, properties = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(properties)) if (value !== undefined) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

function set(element, properties) {
  for (const [key, value] of Object.entries(properties)) {
    if (value === undefined) continue;
    if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key === "class") element.className = value;
    else if (key in element && typeof value === "boolean") element[key] = value;
    else element.setAttribute(key, value);
  }
}

/** The text as a link to the page that explains the code. A page in one file is without the book. */
export function explained(code, text = code) {
  return EMBEDDED ? make("span", {}, text) : make("a", {href: "book/explain/" + encodeURIComponent(code), target: "_blank"}, text);
}

/** Sets the text if it is another one: what has not changed is not laid out again. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Sets an attribute if it is another one. */
export function mark(element, name, value) {
  const text = String(value);
  if (element.getAttribute(name) !== text) element.setAttribute(name, text);
}

/** A number with three decimals, never minus zero. */
export function fixed(value, digits = 3) {
  return value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1");
}

/** Replaces the children by those of `items`, and keeps those whose key is still there. */
export function list(parent, items, key, build, update) {
  const old = new Map([...parent.children].map(child => [child.dataset.key, child]));
  const next = items.map(item => {
    const name = String(key(item));
    const child = old.get(name) ?? build(item);
    child.dataset.key = name;
    update?.(child, item);
    return child;
  });
  if (next.length !== parent.children.length || next.some((child, at) => child !== parent.children[at]))
    parent.replaceChildren(...next);
}

let lastReason;

/** Keeps a reason inside the window. */
function place(reason) {
  reason.style.left = "0";
  const over = reason.getBoundingClientRect().right - document.documentElement.clientWidth + 8;
  if (over > 0) reason.style.left = -over + "px";
}

addEventListener("resize", () => { if (lastReason) place(lastReason); });

/** Shows a reason below its button, over what is there: nothing moves. */
function tell(reason, text) {
  say(reason, text);
  place(reason);
}

/**
 * A button. It is busy during its call. The reason of a refusal appears next to it until the next button is pressed.
 * If it changes nothing, `reads` says so: it can be pressed in a recorded run too.
 */
export function button(label, call, {reads = false, ...properties} = {}) {
  const reason = make("output", {class: "reason", role: "alert"}), locked = LOCKED && !reads ? {disabled: true, title: "Not possible: " + LOCKED} : {};
  const pressed = make("button", {type: "button", ...properties, ...locked, onclick: async () => {
    if (lastReason) say(lastReason, "");
    lastReason = reason;
    pressed.setAttribute("aria-busy", "true");
    try { await call(); } catch (error) { tell(reason, error.message); }
    pressed.removeAttribute("aria-busy");
  }}, label);
  const box = make("span", {class: "action"}, pressed, reason);
  return {element: box, button: pressed, reason};
}

/** Several of which one is on: `[word, label]`. */
export function choice(label, words, call) {
  const buttons = words.map(([word, text]) => ({word, ...button(text, () => call(word), {role: "radio", "aria-checked": "false"})}));
  const group = make("div", {class: "choice", role: "radiogroup", "aria-label": label}, ...buttons.map(one => one.element));
  const element = make("div", {class: "field"}, label, group);
  return {element, show: found => { for (const one of buttons) mark(one.button, "aria-checked", one.word === found); }};
}

/** Something that is on or off. */
export function toggle(label, call, properties) {
  const made = button(label, () => call(made.button.getAttribute("aria-pressed") !== "true"), {"aria-pressed": "false", ...properties});
  return {...made, show: on => mark(made.button, "aria-pressed", on)};
}

/** Puts a text into the clipboard. */
export async function copy(text) {
  if (navigator.clipboard) return navigator.clipboard.writeText(text);
  // Without TLS only a local page has the clipboard.
  const area = make("textarea", {});
  area.value = text;
  document.body.append(area);
  area.select();
  const done = document.execCommand("copy");
  area.remove();
  if (!done) throw new Error("cannot copy: the browser does not allow it");
}

/**
 * The element, or that what it shows is not known: a recording of a real robot tells some fields of the state from a moment on,
 * and others never.
 */
export function ifKnown(feed, fields, element, label) {
  if (!LOCKED) return element;
  const missing = make("section", {class: "unknown", "aria-label": label, hidden: true}, make("h3", {}, label), make("p", {class: "empty"}, "not known"));
  const look = () => { element.hidden = !(missing.hidden = feed.known(...fields)); };
  feed.on("state", look);
  look();
  return make("div", {class: "known"}, element, missing);
}
