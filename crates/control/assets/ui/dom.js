// Makes elements, formats values, and shows why a call was refused. No view needs more of the DOM than this.

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

/** The text as a link to the page that explains the code. */
export function explained(code, text = code) {
  return make("a", {href: "book/explain/" + encodeURIComponent(code), target: "_blank"}, text);
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
 */
export function button(label, call, properties = {}) {
  const reason = make("output", {class: "reason", role: "alert"});
  const pressed = make("button", {type: "button", ...properties, onclick: async () => {
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
