// The timeline of a recorded run, always in sight: a slider over the whole run, lanes with what happened, keys to go from moment
// to moment and to play, and above the views what there is to say about the recording.
//
// Lanes are drawn on a canvas, only those in sight, and again only if something other than the moment has changed: the moment
// is a line above them. The same is in a list of what is near the moment, for those who do not see it.

import {button, copy, list, loadStyle, make, makeSvg, mark, say} from "./dom.js";
import {firstOf} from "./lanes.js";
import {seconds} from "./recorded.js";

const ROW = 20;                 // height of a lane
const RULER = 20;               // height of the seconds above them
const STRIP = 22;               // height of the whole run
const NEAREST = 6;              // pixels around a mark in which it is meant
const LETTER = 6.2;             // width of a letter of a label, about
const SHORTEST = 200;           // microseconds that are shown at least
const FACTORS = [.1, .2, .5, 1, 2, 5, 10, 20, 50, 100];
const LISTED = 5;               // items near the moment on each side
const ZOOM = 1.6;
const SMALL = matchMedia("(max-width: 699px)");
const COLOURS = ["card", "text", "soft", "line", "press", "page", "accent", "ok", "ok-back", "warn", "warn-back", "bad", "bad-back", "forced", "forced-back"];
const LEVELS = ["soft", "forced", "warn", "bad"], BACKS = ["press", "forced-back", "warn-back", "bad-back"];

/** The signs of the keys: a font may be without them. */
const SIGNS = {start: "M2 2h2v12H2zM14 2v12L5 8z", before: "M12 2v12L3 8z", play: "M4 2l9 6-9 6z", pause: "M3 2h4v12H3zM9 2h4v12H9z", after: "M4 2v12l9-6z", end: "M12 2h2v12h-2zM2 2v12l9-6z"};
const sign = name => makeSvg("svg", {viewBox: "0 0 16 16", width: "14", height: "14", fill: "currentColor", "aria-hidden": "true", "data-sign": name}, makeSvg("path", {d: SIGNS[name]}));

/** Time for people: as many decimals as it has, at least three. */
const shownTime = t => {
  const [whole, part = ""] = seconds(t).split(".");
  return whole + "." + part.padEnd(3, "0") + " s";
};

/** The distance of the marks on the ruler: 1, 2 or 5 times a power of ten. */
function stepOf(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * ([1, 2, 5].find(one => one * power >= least) ?? 10);
}

/** A canvas as sharp as the screen. */
function makeCanvas(name) {
  const canvas = make("canvas", {class: name, "aria-hidden": "true"});
  return {canvas, begin(width, height) {
    const scale = devicePixelRatio || 1, pen = canvas.getContext("2d");
    if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
      canvas.width = Math.round(width * scale);
      canvas.height = Math.round(height * scale);
      canvas.style.width = width + "px";
      canvas.style.height = height + "px";
    }
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, height);
    pen.font = "11px system-ui, sans-serif";
    pen.textBaseline = "middle";
    return pen;
  }};
}

let colours;
const colour = name => {
  if (!colours) {
    const style = getComputedStyle(document.documentElement);
    colours = Object.fromEntries(COLOURS.map(one => [one, style.getPropertyValue("--" + one).trim()]));
  }
  return colours[name];
};

/** A label, cut to its room; nothing where there is none. */
function write(pen, text, x, y, room) {
  const fits = Math.floor(room / LETTER);
  if (fits < 3) return;
  pen.fillText(text.length > fits ? text.slice(0, fits - 1) + "\u2026" : text, x, y);
}

/** Draws bars of a lane, and those without a gap between them at once: there may be thousands in a lane. */
function joinBars(pen, y, height) {
  let from = 0, to = -Infinity, style;
  const put = () => {
    if (to <= from) return;
    pen.fillStyle = colour(style);
    pen.fillRect(from, y, to - from, height);
  };
  return {put, add(begin, end, name) {
    if (name === style && begin - to < 1) { to = Math.max(to, end); return; }
    put();
    [from, to, style] = [begin, end, name];
  }};
}

/** The spans of a lane between two places; what is too short to be seen alone is joined with its neighbours. */
function drawSpans(pen, {spans, marks, id}, y, view, width, scale) {
  const x = place => (place - view.from) * scale, isLine = /^(din|dout)\d/.test(id), short = joinBars(pen, y + 3, ROW - 6);
  for (let at = Math.max(0, firstOf(spans.length, one => spans.from[one] > view.from) - 1); at < spans.length && spans.from[at] < view.to; at += 1) {
    const from = Math.max(-1, x(spans.from[at])), to = Math.min(width + 1, x(spans.to[at])), level = spans.level[at], wide = Math.max(1, to - from);
    if (to < 0) continue;
    const edge = isLine && !level ? "ok" : LEVELS[level];
    if (wide < 4) { short.add(from, from + wide, edge); continue; }
    pen.fillStyle = colour(isLine && !level ? "ok-back" : BACKS[level]);
    pen.fillRect(from, y + 3, wide, ROW - 6);
    pen.fillStyle = colour(edge);
    pen.fillRect(from, y + 3, 2, ROW - 6);
    pen.fillRect(from, y + ROW - 4, wide, 1);
    if (marks.length || wide < 4 * LETTER) continue;
    pen.fillStyle = colour(level ? LEVELS[level] : "text");
    write(pen, spans.items[at][3], Math.max(0, from) + 5, y + ROW / 2, wide - 8);
  }
  short.put();
}

/** The marks of a lane between two places. Of several in one column of pixels the worst is drawn. */
function drawMarks(pen, {marks, axis}, y, view, width, scale) {
  const x = place => (place - view.from) * scale, plain = joinBars(pen, y + 5, ROW - 10), bad = joinBars(pen, y + 2, ROW - 4);
  const errors = [];   // they lie above the others
  let column = -Infinity, worst = 0;
  const put = () => {
    if (worst === 3) errors.push(column); else if (worst > 1) bad.add(column - 1, column + 2, LEVELS[worst]); else if (column > -Infinity) plain.add(column, column + 2, worst ? LEVELS[worst] : "accent");
  };
  for (let at = firstOf(marks.length, one => marks.from[one] >= view.from - NEAREST / scale); at < marks.length && marks.from[at] <= view.to; at += 1) {
    const here = Math.round(x(marks.from[at]));
    if (here !== column) {
      put();
      column = here;
      worst = 0;
    }
    worst = Math.max(worst, marks.level[at]);
    const room = Math.min(at + 1 < marks.length ? x(marks.from[at + 1]) : width, x(axis.end(marks.from[at]))) - here - 8;
    if (room < 4 * LETTER) continue;
    pen.fillStyle = colour(worst ? LEVELS[worst] : "text");
    write(pen, marks.items[at][3], here + 5, y + ROW / 2, Math.min(room, 260));
  }
  put();
  plain.put();
  bad.put();
  pen.fillStyle = colour("bad");
  for (const error of errors) pen.fillRect(error - 1, y + 1, 3, ROW - 3);
}

/** The seconds of the epochs, and their borders. */
function drawRuler(pen, axis, view, width, height, scale) {
  const step = stepOf(70 / scale), digits = Math.max(0, -Math.floor(Math.log10(step / 1e6) + 1e-9));
  axis.epochs.forEach(({begins}, epoch) => {
    const start = axis.starts[epoch], end = start + axis.lengths[epoch], x = place => (place - view.from) * scale;
    if (end < view.from || start > view.to) return;
    if (epoch) {
      // The border of two counts of time.
      pen.fillStyle = colour("line");
      pen.fillRect(x(start - axis.gap), 0, Math.max(2, axis.gap * scale), height);
      pen.fillStyle = colour("accent");
      pen.fillRect(x(start) - 2, 0, 2, height);
    }
    const from = Math.ceil((Math.max(view.from, start) - start + begins) / step);
    for (let mark = from; mark * step - begins + start <= Math.min(view.to, end); mark += 1) {
      const at = x(mark * step - begins + start);
      pen.fillStyle = colour("line");
      pen.fillRect(at, 0, 1, height);
      pen.fillStyle = colour("soft");
      if (at + 30 < width) write(pen, (mark * step / 1e6).toFixed(digits) + " s", at + 4, RULER / 2, 70);
    }
  });
}

/** What there is to say about the recording, in sight above the views. */
function makeBanner(run) {
  const name = make("strong", {class: "mono"}), size = make("span"), departure = make("p", {class: "departure", hidden: true}), unknown = make("p", {class: "departure", hidden: true});
  const element = make("section", {id: "recording", "aria-label": "Recording"}, make("p", {}, name, " ", size), departure, unknown);
  return {element, draw() {
    const {info} = run, {events, complete, epochs} = info, last = epochs.at(-1);
    say(name, info.name.split(/[\\/]/).at(-1));
    mark(name, "title", info.name + ", " + info.origin);
    const parts = epochs.length > 1 ? " in " + epochs.length + " counts of time, each after a reset or a restored snapshot" : " in " + shownTime(last.ends - last.begins);
    say(size, (info.kind === "robot" ? "recorded from a real robot" : "a recorded run, to be watched and not changed") + ": " + events + " events" + parts
      + (complete ? "." : ". It is still being opened: " + Math.floor(100 * info.played / Math.max(1, info.records)) + " %."));
    departure.hidden = !info.departure;
    say(departure, "The recording does not come out again as it was: " + info.departure + ". From there on the page shows what this version of ts3100 does. "
      + "Either another version made the recording, or the file was changed.");
    unknown.hidden = info.kind !== "robot";
    say(unknown, "The arm, the lines and the positions are those of the status frames (SF) of the robot. A recording does not tell the rest: "
      + (info.unknown?.length ? info.unknown.join(", ").replaceAll("_", " ") + " are not known." : "it is not known."));
  }};
}

/** The summary of a page in one file is there for those without scripts. Here it is folded, and its moments are links. */
function foldSummary(summary) {
  summary.open = false;
  for (const line of summary.querySelectorAll("li")) {
    const found = /^([\d.]+) s, event (\d+)/.exec(line.textContent);
    if (found) line.replaceChildren(make("a", {href: "#t=" + found[1] + "&e=" + found[2]}, found[0]), line.textContent.slice(found[0].length));
  }
}

export async function create(run) {
  const styled = loadStyle("timeline.css");
  const banner = makeBanner(run), strip = makeCanvas("strip"), lanes = makeCanvas("lanes");
  let view = {from: 0, to: run.axis.total}, axis = run.axis, chosen = "", frame = 0, width = 0, wide = 0, high = 0, nearShown = false;

  // Keys.
  const key = (label, title, call) => make("button", {type: "button", title, "aria-label": title.replace(/ \(.*/, ""), onclick: call}, label);
  const play = key(sign("play"), "Play (space)", () => toggle());
  const factor = make("select", {"aria-label": "Speed of playing", title: "Speed of playing"}, ...FACTORS.map(one => make("option", {value: one}, "\u00d7" + one)));
  factor.value = "1";
  factor.addEventListener("change", () => { run.factor = Number(factor.value); });
  const now = make("output", {class: "mono now", "aria-label": "Moment"});
  const items = make("ul", {"aria-label": "Near this moment"});
  const near = make("section", {class: "near", "aria-label": "Near this moment", hidden: true}, items);
  const lister = make("button", {type: "button", "aria-pressed": "false", title: "List what is near the moment", onclick: () => {
    nearShown = near.hidden;
    near.hidden = !nearShown;
    mark(lister, "aria-pressed", nearShown);
    drawNear();
    layout();
  }}, "List");
  const copied = make("output", {class: "sr"});
  const copier = button("Copy link", async () => {
    await copy(location.href.split("#")[0] + "#" + run.view + run.suffix);
    say(copied, "The link is copied");
    say(copier.button, "Copied");
    setTimeout(() => say(copier.button, "Copy link"), 1500);
  }, {reads: true, title: "Copy the address of this moment"});
  const folder = make("button", {type: "button", "aria-controls": "timeline-body", onclick: () => setOpen(!isOpen)});

  const slider = make("div", {class: "slider", role: "slider", tabindex: "0", "aria-label": "Moment", "aria-orientation": "horizontal", "aria-valuemin": "0"}, strip.canvas, make("i"));
  const thumb = slider.lastChild;
  const titles = make("div", {class: "titles", role: "listbox", "aria-label": "Lanes", "aria-orientation": "vertical"});
  const cursor = make("i", {class: "cursor"}), tip = make("p", {class: "tip", hidden: true, "aria-hidden": "true"});
  const stage = make("div", {class: "stage"}, lanes.canvas, cursor);
  const scroller = make("div", {class: "scroller"}, titles, stage);
  const body = make("div", {id: "timeline-body", class: "body"}, scroller, near);
  const jump = forward => { const lane = laneOf(chosen); const item = lane?.step(run.target ?? run.moment, forward); if (item) run.goTo(item, {step: true}); };
  const jumpBad = forward => { const item = laneOf("ng")?.step(run.target ?? run.moment, forward); if (item) run.goTo(item, {step: true}); };
  const element = make("section", {id: "timeline", "aria-label": "Timeline"},
    make("div", {class: "transport"},
      make("span", {class: "group"}, key(sign("start"), "To the start (Home)", () => run.toStart()), key(sign("before"), "Event before (left arrow)", () => run.step(false)), play,
        key(sign("after"), "Event after (right arrow)", () => run.step(true)), key(sign("end"), "To the end (End)", () => run.toEnd())), factor,
      make("span", {class: "group"}, key("\u25c0 NG", "NG or finding before (P)", () => jumpBad(false)), key("NG \u25b6", "NG or finding after (N)", () => jumpBad(true))),
      make("span", {class: "group", "data-lane": ""}, key("\u25c0 lane", "Item of the lane before (p)", () => jump(false)), key("lane \u25b6", "Item of the lane after (n)", () => jump(true))),
      now,
      make("span", {class: "group zoom"}, key("\u2212", "Zoom out (Ctrl and wheel)", () => zoom(1 / ZOOM)), key("+", "Zoom in (Ctrl and wheel)", () => zoom(ZOOM)), key("Fit", "Show the whole run", fit)),
      lister, copier.element, folder, copied),
    slider, body, tip);
  let isOpen = true;

  const laneOf = id => run.lanes.find(lane => lane.id === id);
  const target = () => run.target ?? run.moment;

  function toggle() {
    if (run.playing) run.pause(); else run.play();
  }

  function setOpen(on) {
    isOpen = on;
    body.hidden = !on;
    say(folder, on ? "Hide lanes" : "Lanes");
    mark(folder, "aria-expanded", on);
    mark(element, "data-open", on);
    try { localStorage.setItem("ts3100.lanes", on); } catch { /* a browser may keep nothing */ }
    layout();
  }

  // What is in sight of the run.

  function show(from, to) {
    const long = Math.min(axis.total, Math.max(SHORTEST, to - from)), begin = Math.max(0, Math.min(axis.total - long, from));
    view = {from: begin, to: begin + long};
    draw();
  }
  function fit() { show(0, axis.total); }

  /** Around a place, which stays where it is; without one around the moment. */
  function zoom(by, around) {
    const moment = target(), at = around ?? (moment ? axis.place(moment.epoch, moment.t) : (view.from + view.to) / 2);
    const centre = Math.min(view.to, Math.max(view.from, at)), long = (view.to - view.from) / by, share = (centre - view.from) / (view.to - view.from);
    show(centre - share * long, centre + (1 - share) * long);
  }
  const pan = pixels => { const by = pixels * (view.to - view.from) / Math.max(1, wide); show(view.from + by, view.to + by); };

  function draw() {
    if (!frame) frame = requestAnimationFrame(() => { frame = 0; drawNow(); });
  }

  function drawNow() {
    if (!width) return;
    const pen = strip.begin(width, STRIP), scale = width / axis.total;
    pen.fillStyle = colour("press");
    pen.fillRect(0, 0, width, STRIP);
    drawRuler(pen, axis, {from: 0, to: axis.total}, width, STRIP, scale);
    const bad = laneOf("ng");
    if (bad) drawSums(pen, bad.marks, scale);
    if (view.to - view.from < axis.total * .999) {
      pen.strokeStyle = colour("accent");
      pen.lineWidth = 2;
      pen.strokeRect(view.from * scale + 1, 1, Math.max(3, (view.to - view.from) * scale - 2), STRIP - 2);
    }
    if (isOpen && wide) drawLanes();
    drawMoment();
  }

  /** Where there is something wrong, by pixels: the worst of each. */
  function drawSums(pen, marks, scale) {
    let column = -1, worst = 0;
    for (let at = 0; at <= marks.length; at += 1) {
      const x = at < marks.length ? Math.round(marks.from[at] * scale) : -2;
      if (x !== column) {
        if (worst) {
          pen.fillStyle = colour(LEVELS[worst]);
          pen.fillRect(column, STRIP - 3 * worst, 1.5, 3 * worst);
        }
        column = x;
        worst = 0;
      }
      if (at < marks.length) worst = Math.max(worst, marks.level[at]);
    }
  }

  function drawLanes() {
    const pen = lanes.begin(wide, high), scale = wide / (view.to - view.from), top = scroller.scrollTop, first = Math.floor(top / ROW);
    pen.fillStyle = colour("card");
    pen.fillRect(0, 0, wide, high);
    for (let at = first; at < run.lanes.length && RULER + at * ROW - top < high; at += 1) if (run.lanes[at].id === chosen) {
      pen.fillStyle = colour("page");
      pen.fillRect(0, RULER + at * ROW - top, wide, ROW);
    }
    drawRuler(pen, axis, view, wide, high, scale);
    pen.save();
    pen.beginPath();
    pen.rect(0, RULER, wide, high - RULER);
    pen.clip();
    for (let at = first; at < run.lanes.length && RULER + at * ROW - top < high; at += 1) {
      const y = RULER + at * ROW - top;
      drawSpans(pen, run.lanes[at], y, view, wide, scale);
      drawMarks(pen, run.lanes[at], y, view, wide, scale);
      pen.fillStyle = colour("line");
      pen.fillRect(0, y + ROW - 1, wide, 1);
    }
    pen.restore();
  }

  function drawMoment() {
    const moment = target();
    if (!moment || !width) return;
    const place = axis.place(moment.epoch, moment.t);
    thumb.style.transform = "translateX(" + (place * width / axis.total).toFixed(1) + "px)";
    const x = (place - view.from) * wide / (view.to - view.from);
    cursor.hidden = x < -1 || x > wide + 1;
    cursor.style.transform = "translateX(" + x.toFixed(1) + "px)";
    const event = moment.e === undefined ? "" : ", event " + moment.e + " of " + run.info.events;
    const part = axis.epochs.length > 1 ? ", part " + (moment.epoch + 1) + " of " + axis.epochs.length : "";
    say(now, shownTime(moment.t) + (moment.e === undefined ? "" : " \u00b7 " + moment.e));
    mark(now, "title", shownTime(moment.t) + event + part);
    mark(slider, "aria-valuenow", (place / 1e6).toFixed(3));
    mark(slider, "aria-valuetext", shownTime(moment.t) + part + event);
    const word = run.playing ? "Pause" : "Play";
    if (play.getAttribute("aria-label") !== word) {
      mark(play, "aria-label", word);
      mark(play, "title", word + " (space)");
      play.replaceChildren(sign(word.toLowerCase()));
    }
  }

  /** The moment stays in sight. */
  function follow() {
    const moment = target();
    if (!moment) return;
    const place = axis.place(moment.epoch, moment.t), long = view.to - view.from;
    if (place >= view.from && place <= view.to) return drawMoment();
    // A step beyond the edge turns the page; a jump has the moment in the middle.
    const from = place > view.to && place < view.to + long / 2 ? place - long * .1 : place - long / 2;
    show(from, from + long);
  }

  function drawNear() {
    if (!nearShown || !run.moment || run.busy) return;
    const {moment} = run, at = axis.place(moment.epoch, moment.t);
    const spans = run.lanes.map(lane => ({lane, item: lane.within(moment), span: true})).filter(one => one.item);
    const marks = run.lanes.flatMap(lane => lane.near(moment, LISTED).filter(item => item.length < 6).map(item => ({lane, item})));
    const placed = marks.map(one => ({...one, far: axis.place(axis.epochOf(one.item[0]), one.item[1]) - at || one.item[0] - moment.e}));
    const before = placed.filter(one => one.far <= 0).sort((one, other) => other.far - one.far || other.item[0] - one.item[0]).slice(0, LISTED).reverse();
    const after = placed.filter(one => one.far > 0).sort((one, other) => one.far - other.far || one.item[0] - other.item[0]).slice(0, LISTED);
    list(items, [...spans, ...before, ...after], one => one.lane.id + " " + one.item.slice(0, 4), one => make("li", {}, make("button", {type: "button", onclick: () => run.goTo(one.item)},
      make("b", {}, shownTime(one.item[1])), make("span", {}))), (row, {lane, item, span, far}) => {
      say(row.firstChild.lastChild, (span ? "since then, " : "") + lane.title + ": " + (item[2] ? item[2] + ", " : "") + item[3]);
      mark(row, "data-level", item[2] || "plain");
      mark(row, "data-now", span || item[0] === moment.e);
      mark(row, "data-later", far > 0);
    });
  }

  // The lanes.

  function choose(id, focus) {
    chosen = id;
    for (const title of titles.children) {
      const on = title.dataset.lane === id;
      mark(title, "aria-selected", on);
      title.tabIndex = on ? 0 : -1;
      if (on && focus) { title.focus({preventScroll: true}); title.scrollIntoView({block: "nearest"}); }
    }
    draw();
  }

  titles.addEventListener("click", event => { const title = event.target.closest("[data-lane]"); if (title) choose(title.dataset.lane); });
  titles.addEventListener("keydown", event => {
    const ids = run.lanes.map(lane => lane.id), step = {ArrowDown: 1, ArrowUp: -1}[event.key];
    if (!step) return;
    event.preventDefault();
    choose(ids[Math.max(0, Math.min(ids.length - 1, ids.indexOf(chosen) + step))], true);
  });

  /** The items that are meant by a place on the screen: `{lane, item, isMark}`. */
  function under(event) {
    const box = stage.getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top, row = Math.floor((y - RULER + scroller.scrollTop) / ROW);
    const scale = wide / (view.to - view.from), place = view.from + x / scale, lane = y >= RULER ? run.lanes[row] : undefined;
    if (!lane) return {place};
    const {marks, spans} = lane;
    let best, least = NEAREST;
    for (let at = firstOf(marks.length, one => marks.from[one] > place - NEAREST / scale); at < marks.length && marks.from[at] <= place + NEAREST / scale; at += 1) {
      // Of those at hand the worst counts, then the nearest.
      const far = Math.abs(marks.from[at] - place) * scale - marks.level[at] * NEAREST;
      if (far < least) { least = far; best = at; }
    }
    if (best !== undefined) return {place, lane, item: marks.items[best], isMark: true};
    const at = firstOf(spans.length, one => spans.from[one] > place) - 1;
    return {place, lane, item: at >= 0 && spans.to[at] >= place ? spans.items[at] : undefined};
  }

  function hover(event) {
    const {lane, item} = under(event);
    tip.hidden = !item;
    if (!item) return;
    const [, t, level, label, , end] = item;
    say(tip, shownTime(t) + (end === undefined ? "" : " to " + shownTime(end)) + "  " + lane.title + ": " + (level ? level + ": " : "") + label);
    const box = element.getBoundingClientRect();
    tip.style.left = Math.max(4, Math.min(event.clientX - box.left + 12, box.width - tip.offsetWidth - 4)) + "px";
    tip.style.top = event.clientY - box.top - tip.offsetHeight - 10 + "px";
  }

  // A pointer moves the moment, two fingers what is in sight.
  const fingers = new Map();
  let pinch, held = false, panned;

  function placeOf(event) {
    const box = stage.getBoundingClientRect();
    return axis.at(view.from + Math.max(0, Math.min(wide, event.clientX - box.left)) * (view.to - view.from) / wide);
  }

  stage.addEventListener("pointerdown", event => {
    if (event.button === 1) { panned = event.clientX; stage.setPointerCapture(event.pointerId); event.preventDefault(); return; }
    if (event.button !== 0) return;
    stage.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event.clientX);
    if (fingers.size > 1) { held = false; run.drop(); pinch = undefined; return; }
    const {lane, item, isMark} = under(event);
    tip.hidden = true;
    if (lane) choose(lane.id);
    held = true;
    if (isMark) run.goTo(item); else run.drag(placeOf(event));
  });
  stage.addEventListener("pointermove", event => {
    if (panned !== undefined) { pan(panned - event.clientX); panned = event.clientX; return; }
    if (fingers.has(event.pointerId)) fingers.set(event.pointerId, event.clientX);
    if (fingers.size === 2) {
      const [one, other] = fingers.values(), centre = (one + other) / 2, long = Math.max(20, Math.abs(one - other));
      if (pinch) {
        pan(pinch.centre - centre);
        zoom(long / pinch.long, view.from + (centre - stage.getBoundingClientRect().left) * (view.to - view.from) / wide);
      }
      pinch = {centre, long};
    } else if (held && (Math.abs(event.movementX) > 0 || run.busy)) run.drag(placeOf(event));
    else if (!fingers.size) hover(event);
  });
  for (const kind of ["pointerup", "pointercancel"]) stage.addEventListener(kind, event => {
    fingers.delete(event.pointerId);
    panned = undefined;
    if (held && !fingers.size) { held = false; run.drop(); }
  });
  stage.addEventListener("pointerleave", () => { tip.hidden = true; });
  stage.addEventListener("wheel", event => {
    if (event.ctrlKey) {
      event.preventDefault();
      zoom(Math.exp(-event.deltaY / (event.deltaMode ? 8 : 200)), view.from + (event.clientX - stage.getBoundingClientRect().left) * (view.to - view.from) / wide);
    } else if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
      event.preventDefault();
      pan(event.deltaX || event.deltaY);
    }
  }, {passive: false});
  scroller.addEventListener("scroll", draw, {passive: true});

  let box;   // of the slider: it stays where it is during a drag
  const sliderPlace = event => axis.at(Math.max(0, Math.min(1, (event.clientX - box.left) / box.width)) * axis.total);
  slider.addEventListener("pointerdown", event => {
    if (event.button !== 0) return;
    box = slider.getBoundingClientRect();
    slider.setPointerCapture(event.pointerId);
    run.drag(sliderPlace(event));
  });
  slider.addEventListener("pointermove", event => { if (slider.hasPointerCapture(event.pointerId)) run.drag(sliderPlace(event)); });
  for (const kind of ["pointerup", "pointercancel"]) slider.addEventListener(kind, () => run.drop());
  slider.addEventListener("wheel", event => {
    event.preventDefault();
    if (event.ctrlKey) zoom(Math.exp(-event.deltaY / 200)); else pan(event.deltaX || event.deltaY);
  }, {passive: false});

  // Keys of the page. What has the focus comes first: a field, the tabs, a list.
  document.addEventListener("keydown", event => {
    const {target: on} = event;
    if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey || !run.moment) return;
    if (on.closest?.("input, select, textarea, [contenteditable]") && on.type !== "checkbox") return;
    if (event.key === " " && on.closest?.("button, a, summary, label, [type=checkbox]")) return;
    const call = {" ": toggle, ArrowLeft: () => run.step(false), ArrowRight: () => run.step(true), p: () => jump(false), n: () => jump(true),
      P: () => jumpBad(false), N: () => jumpBad(true), Home: () => run.toStart(), End: () => run.toEnd()}[event.key];
    if (!call) return;
    event.preventDefault();
    call();
  });

  // The page leaves room for the timeline, which is as high as its lanes are many.
  function layout() {
    width = slider.clientWidth;
    wide = stage.clientWidth;
    high = scroller.clientHeight;
    document.documentElement.style.setProperty("--dock", element.offsetHeight + "px");
    draw();
  }

  function take() {
    const whole = view.from === 0 && view.to === axis.total;
    axis = run.axis;
    if (whole) view = {from: 0, to: axis.total};
    banner.draw();
    mark(slider, "aria-valuemax", (axis.total / 1e6).toFixed(3));
    list(titles, run.lanes, lane => lane.id, lane => make("div", {role: "option", "data-lane": lane.id, tabindex: "-1"}), (title, lane) => {
      say(title, lane.title + (lane.leftOut ? " *" : ""));
      mark(title, "title", lane.title + (lane.leftOut ? ": " + lane.leftOut + " items are left out" : ""));
    });
    stage.style.minHeight = RULER + run.lanes.length * ROW + "px";
    if (!laneOf(chosen)) choose(run.lanes[0]?.id ?? "");
    layout();
  }

  await styled;
  document.getElementById("top").after(banner.element);
  const summary = document.getElementById("summary");
  if (summary) foldSummary(summary);
  document.body.append(element);
  new ResizeObserver(layout).observe(element);
  new ResizeObserver(layout).observe(scroller);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { colours = undefined; draw(); });
  run.on("trace", take);
  run.on("moment", follow);
  run.on("settled", drawNear);
  addEventListener("hashchange", () => run.fromAddress());
  let kept = null;
  try { kept = localStorage.getItem("ts3100.lanes"); } catch { /* a browser may keep nothing */ }
  setOpen(kept === null ? !SMALL.matches : kept === "true");
  banner.draw();
}
