// SCOL in colours, and what can be typed at a place of a program.

import {make} from "./dom.js";

const WORDS = ("AND AS BCDOUT BREAK CLOSE1 CLOSE2 CLOSEI1 CLOSEI2 COM1 CR CRE DATA DELAY DIM DIN DISABLE DO DOUT ELSE ENABLE END FOR FREELOAD GLOBAL GOTO IF "
  + "IGNORE INPUT IP1 IP2 KILL MOVE MOVEA MOVEC MOVEI MOVEJ MOVES NEXT NOT NOWAIT OPEN1 OPEN2 OPENI1 OPENI2 OR PAUSE PRINT PROGRAM PULOUT READY REMARK "
  + "RESTORE RESUME RETURN SETGAIN SPEED STEP STOP SWITCH TASK THEN TO TP WAIT WITH MOD POINT TRANS PAYLOAD WORK REAL INT ON OFF TRUE FALSE").split(" ");
const KNOWN = new Set(WORDS);
const TOKENS = /('.*$|\bREMARK\b.*$)|("[^"]*"?)|([A-Za-z][A-Za-z0-9_]*)|([^'"A-Za-z]+)/gi;
const NAMES = /^\s*(?:(?:POINT|TRANS|PAYLOAD|WORK|PROGRAM|DIM|REAL|INT)\s+)?([A-Za-z][A-Za-z0-9_]*)\s*(?:=|:|\(|$)/gim;
const OFFERED = 8;   // words that are offered

/** A line of SCOL as text nodes and spans. */
export function coloured(text) {
  const parts = [];
  const label = /^\s*[A-Za-z][A-Za-z0-9_]*:/.exec(text)?.[0] ?? "";
  if (label) parts.push(make("span", {class: "label"}, label));
  for (const [whole, comment, string, word] of text.slice(label.length).matchAll(TOKENS)) {
    if (comment) parts.push(make("span", {class: "comment"}, whole));
    else if (string) parts.push(make("span", {class: "string"}, whole));
    else if (word && KNOWN.has(word.toUpperCase())) parts.push(make("span", {class: "word"}, whole));
    else parts.push(whole);
  }
  return parts;
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
