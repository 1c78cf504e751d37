// SCOL in colours, and what can be typed at a place of a program.

import {make} from "./dom.js";
import {RULES, WORDS} from "./grammar.js";

// Classes of the scopes of the grammar, by their beginnings; a scope without one has the colour of the text.
const CLASSES = Object.entries({comment: "comment", string: "string", "constant.": "number", "entity.": "label", "support.": "builtin", "variable.language": "builtin",
  "keyword.operator.word": "word", "keyword.control": "word", "keyword.other": "word", storage: "word"});
// All rules in one expression: the leftmost match wins, and among those the first rule, as in every editor.
const TOKENS = new RegExp(RULES.map(rule => "(" + rule.match.replace("(?i)", "") + ")").join("|"), "gi");
const NAMES = /^\s*(?:(?:POINT|TRANS|PAYLOAD|WORK|PROGRAM|DIM|REAL|INT)\s+)?([A-Za-z][A-Za-z0-9_]*)\s*(?:=|:|\(|$)/gim;
const OFFERED = 8;   // words that are offered

// The group of each rule in that expression, and its scopes by the groups after it.
let groups = 0;
const SCOPES = RULES.map(({name, captures = {}}) => {
  const scopes = Object.values(captures).map(one => one.name), group = groups + 1;
  groups = group + scopes.length;
  return {group, name, scopes};
});

/** A line as pieces `[text, scope]`; the scope of blanks is undefined. */
export function tokens(text) {
  const pieces = [];
  let at = 0;
  function add(end, scope) {
    if (end > at) pieces.push([text.slice(at, end), scope]);
    at = end;
  }
  for (const found of text.matchAll(TOKENS)) {
    add(found.index);
    const {group, name, scopes} = SCOPES.find(rule => found[rule.group] !== undefined);
    scopes.forEach((scope, number) => {
      const inner = found[group + 1 + number];
      if (inner === undefined) return;
      // Between the groups of a rule there are blanks alone.
      const from = text.indexOf(inner, at);
      add(from);
      add(from + inner.length, scope);
    });
    add(found.index + found[0].length, name);
  }
  add(text.length);
  return pieces;
}

/** A line of SCOL as text nodes and spans. */
export function coloured(text) {
  const parts = [];
  let plain = "";
  for (const [piece, scope] of tokens(text)) {
    const known = scope && CLASSES.find(([begin]) => scope.startsWith(begin))?.[1];
    if (!known) { plain += piece; continue; }
    if (plain) parts.push(plain);
    parts.push(make("span", {class: known}, piece));
    plain = "";
  }
  return plain ? [...parts, plain] : parts;
}

/** Words that continue what is before `at` in the text: those of the language, then points, variables, labels and programs. `[begin, words]`. */
export function completions(text, at) {
  const line = text.slice(text.lastIndexOf("\n", at - 1) + 1, at), begun = /[A-Za-z][A-Za-z0-9_]*$/.exec(line)?.[0].toUpperCase() ?? "";
  if (!begun || /[A-Za-z0-9_]/.test(text[at] ?? "") || /^[^"]*(?:"[^"]*"[^"]*)*'/.test(line) || (line.match(/"/g)?.length ?? 0) % 2) return ["", []];
  const names = new Set(), before = at - begun.length;
  for (const found of text.matchAll(NAMES)) if (found.index + found[0].indexOf(found[1]) !== before) names.add(found[1].toUpperCase());
  const fits = word => word.startsWith(begun) && word !== begun;
  return [begun, [...new Set([...[...names].filter(fits).sort(), ...WORDS.filter(fits)])].slice(0, OFFERED)];
}
