// The editor of a program: the text in colours below a transparent text area, diagnostics while it is typed, and completion.

import {make, button, explained, mark, say} from "./dom.js";
import {coloured, completions} from "./scol.js";

const COLOURED = 200_000;      // characters of a text that is coloured
const DIAGNOSTICS = 100;       // diagnostics that are shown
const PAUSE = 300;             // ms without typing before the text is checked

/** Errors and warnings of a text or a file: `[{line, column, length, severity, code, message, help}]`. */
export async function check(robot, body) {
  return (await robot.post("check", body)).slice(0, DIAGNOSTICS);
}

export function diagnostic(found) {
  return [make("strong", {}, explained(found.code, found.severity + " " + found.code)), " line " + found.line + ", column " + found.column + ": " + found.message
    + (found.help ? "; " + found.help : "")];
}

/** The words that can follow, as a list below the cursor. */
function makeOffer(text, sheet) {
  const element = make("ul", {id: "editor-offer", class: "offer", role: "listbox", "aria-label": "Completion", hidden: true});
  let words = [], begun = "", chosen = 0;

  function draw() {
    element.replaceChildren(...words.map((word, at) => make("li", {id: "editor-offer-" + at, role: "option", "aria-selected": String(at === chosen),
      onpointerdown: event => { event.preventDefault(); take(at); }}, word)));
    element.hidden = !words.length;
    if (words.length) mark(text, "aria-activedescendant", "editor-offer-" + chosen); else text.removeAttribute("aria-activedescendant");
  }

  function look() {
    const at = text.selectionStart;
    [begun, words] = text.selectionEnd === at ? completions(text.value, at) : ["", []];
    chosen = 0;
    draw();
    if (!words.length) return;
    const before = text.value.slice(0, at).split("\n"), style = getComputedStyle(text), high = parseFloat(style.lineHeight);
    const wide = sheet.querySelector(".probe").getBoundingClientRect().width / 10;
    element.style.top = before.length * high + parseFloat(style.paddingTop) + "px";
    element.style.left = Math.min(text.clientWidth - element.offsetWidth, (before.at(-1).length - begun.length) * wide + parseFloat(style.paddingLeft)) + text.parentElement.offsetLeft + "px";
  }

  function close() {
    words = [];
    draw();
  }

  function take(at) {
    const end = text.selectionStart;
    text.setRangeText(words[at], end - begun.length, end, "end");
    text.dispatchEvent(new Event("input"));
    close();
  }

  text.addEventListener("keydown", event => {
    if (!words.length) return;
    if (event.key === "Escape") close();
    else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      chosen = (chosen + (event.key === "ArrowDown" ? 1 : words.length - 1)) % words.length;
      draw();
    } else if (event.key === "Tab" || event.key === "Enter") take(chosen);
    else return;
    event.preventDefault();
  });
  text.addEventListener("blur", close);
  return {element, look, close};
}

/** The editor. `done` is told when the text is stored or discarded. */
export function makeEditor(robot, done) {
  const numbers = make("div", {class: "numbers", "aria-hidden": "true"}), colours = make("pre", {class: "colours", "aria-hidden": "true"});
  const text = make("textarea", {"aria-label": "Text of the file", "aria-autocomplete": "list", "aria-controls": "editor-offer",
    spellcheck: "false", wrap: "off", autocomplete: "off"});
  const found = make("ul", {class: "notes", "aria-label": "Diagnostics"});
  const told = make("p", {class: "hint", role: "status"});
  const sheet = make("div", {class: "sheet"}, numbers, make("span", {class: "probe", "aria-hidden": "true"}, "0000000000"), make("div", {class: "paper"}, colours, text));
  const offer = makeOffer(text, sheet);
  sheet.append(offer.element);
  let file = "", stored = "", ends = "\n", timer, asked = 0, shown = [], diagnostics = [];

  /** Colours the lines that have changed, and marks those with diagnostics. */
  function draw() {
    const lines = text.value.split("\n"), colour = text.value.length <= COLOURED;
    lines.forEach((line, at) => {
      if (shown[at] === line) return;
      const row = colours.children[at] ?? colours.appendChild(make("div"));
      row.replaceChildren(...(line === "" ? ["\n"] : colour ? coloured(line) : [line]));
    });
    while (colours.childElementCount > lines.length) colours.lastChild.remove();
    shown = lines;
    while (numbers.childElementCount < lines.length) numbers.append(make("div", {}, String(numbers.childElementCount + 1)));
    while (numbers.childElementCount > lines.length) numbers.lastChild.remove();
    for (const rows of [numbers.children, colours.children])
      for (const [at, row] of [...rows].entries()) mark(row, "data-severity", diagnostics.find(one => one.line === at + 1)?.severity ?? "");
    text.style.height = colours.offsetHeight + "px";
    text.style.width = "100%";
    text.style.width = Math.max(text.parentElement.clientWidth, colours.scrollWidth) + "px";
  }

  function jump(one) {
    const from = text.value.split("\n").slice(0, one.line - 1).reduce((sum, line) => sum + line.length + 1, 0) + one.column - 1;
    text.focus();
    text.setSelectionRange(from, from + (one.length || 1));
    colours.children[one.line - 1]?.scrollIntoView({block: "nearest"});
  }

  async function look() {
    const mine = asked += 1;
    try {
      const all = await check(robot, {text: text.value});
      if (mine !== asked) return;
      diagnostics = all;
      found.replaceChildren(...all.map(one => make("li", {"data-severity": one.severity}, make("button", {type: "button", title: "Go to this place", onclick: () => jump(one)}, "line " + one.line), " ", ...diagnostic(one))));
      draw();
      say(told, all.length ? all.length + (all.length === 1 ? " diagnostic" : " diagnostics") : "No errors, no warnings.");
    } catch (error) {
      if (mine === asked) say(told, error.message);
    }
  }

  text.addEventListener("input", event => {
    draw();
    clearTimeout(timer);
    timer = setTimeout(look, PAUSE);
    if (event.inputType?.startsWith("insert")) offer.look(); else offer.close();
  });
  const save = button("Download to the RAM drive", async () => {
    await robot.put("files/" + encodeURIComponent(file), {text: text.value.replaceAll("\n", ends)});
    stored = text.value;
    close();
  }, {class: "primary", title: "Store the text under the name of the file"});
  const discard = button("Discard", () => close(), {title: "Close the editor without storing"});
  function close() {
    clearTimeout(timer);
    element.hidden = true;
    asked += 1;
    done(file);
  }
  const element = make("div", {class: "editor", hidden: true}, make("div", {class: "row"}, save.element, discard.element, told), sheet, found);
  return {
    element,
    get open() { return !element.hidden; },
    get dirty() { return !element.hidden && text.value !== stored; },
    close() { element.hidden = true; },
    edit(name, content) {
      file = name;
      // A textarea knows only LF. What the file has is put back when it is stored.
      ends = content.includes("\r\n") ? "\r\n" : content.includes("\n") ? "\n" : content.includes("\r") ? "\r" : "\n";
      text.value = content;
      stored = text.value;
      diagnostics = [];
      found.replaceChildren();
      say(told, "");
      element.hidden = false;
      draw();
      look();
      text.focus();
      text.setSelectionRange(0, 0);
    },
  };
}
