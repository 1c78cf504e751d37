// The arm: in 3D, or from the top and from the side; its axes within their limits, and its position.
//
// The pose is that of the state, which `robot` keeps up to date. What else a picture needs (model, coordinate systems, path) is
// read when a motion begins or ends. The picture in 3D is a module of its own, which is loaded when it is first looked at.

import {LOCKED, fixed, ifKnown, list, load, make, makeSvg, mark, say} from "./dom.js";
import {labels} from "./labels.js";
import {along, chain, distance, floor, frame, IDENTITY, origin, place, reach, times} from "./links.js";

const POINTS = 40;      // taught points that are drawn
const TRACE = 600;      // places of the tool that are kept while it moves
const STEP = 1;         // between two of them, in mm
const NEAR = 0.05;      // part of its range within which an axis is near a limit
const SMALL = matchMedia("(max-width: 699px)"), TALL = matchMedia("(max-aspect-ratio: 1/1) and (min-width: 700px)");
const FONT = 11;        // height of the labels in pixels

const names = model => model.kind === "scara" ? ["X", "Y", "Z", "C", "T"].slice(0, Math.max(4, model.axes.length)) : ["X", "Y", "Z", "A", "B", "C"];
const unit = (model, axis) => model.kind === "scara" && axis === 2 ? " mm" : "\u00b0";

/** Which limit an axis is near: `min`, `max` or none. */
function limit({min, max}, value) {
  const share = (value - min) / (max - min);
  return share < NEAR ? "min" : share > 1 - NEAR ? "max" : "";
}

/** X Y Z A B C, or of a SCARA X Y Z C, as a coordinate system. */
const system = (model, found) => frame(model.kind === "scara" && found.length < 6 ? [...found.slice(0, 3), 0, 0, found[3]] : found);

/** The positions of DATA that lie in a coordinate system of their own, by name. */
function works(source) {
  const found = new Map();
  for (const [, work, point] of source.matchAll(/^\s*WORK\s+(\w+)[^\n]*\n\s*(?:POINT\s+)?(\w+)\s*=/gim)) found.set(point.toUpperCase(), work.toUpperCase());
  return found;
}

/** The outline of a link: two circles and their tangents, or without the circles where the ends are flat; seen along it, it is round. */
function outline([x, y], r, [x2, y2], r2, flat, round) {
  const n = one => one.toFixed(1), long = distance([x, y], [x2, y2]), angle = Math.atan2(y2 - y, x2 - x);
  const at = (cx, cy, radius, turned) => n(cx + radius * Math.cos(angle + turned)) + " " + n(cy + radius * Math.sin(angle + turned));
  if (round || long <= Math.abs(r - r2) + .1) {
    const [cx, cy, big] = r > r2 ? [x, y, r] : [x2, y2, r2];
    return `M${at(cx, cy, big, 0)}A${n(big)} ${n(big)} 0 1 1 ${at(cx, cy, big, Math.PI)}A${n(big)} ${n(big)} 0 1 1 ${at(cx, cy, big, 0)}Z`;
  }
  const open = flat ? Math.PI / 2 : Math.acos((r - r2) / long), large = open < Math.PI / 2 ? 1 : 0;
  const arc = (radius, big, end) => flat ? "L" + end : `A${n(radius)} ${n(radius)} 0 ${big} 1 ${end}`;
  return `M${at(x, y, r, open)}${arc(r, large, at(x, y, r, -open))}L${at(x2, y2, r2, -open)}${arc(r2, 1 - large, at(x2, y2, r2, open))}Z`;
}

/** Sets attributes: of a number one decimal is enough. */
function put(element, values) {
  for (const [name, value] of Object.entries(values)) mark(element, name, typeof value === "number" ? value.toFixed(1) : value);
}

/** A picture in SVG. `look(scene)` says how the world is projected, and what the picture shows in words. */
function makePicture(name, look) {
  const ground = makeSvg("path", {class: "ground"}), ring = makeSvg("circle", {class: "reach"});
  const path = makeSvg("polyline", {class: "path"}), trace = makeSvg("polyline", {class: "trace"});
  const parts = makeSvg("g"), axes = makeSvg("g"), points = makeSvg("g"), texts = makeSvg("g");
  const tip = makeSvg("circle", {class: "tip"});
  const svg = makeSvg("svg", {role: "img", class: "picture"}, ring, ground, trace, path, parts, axes, points, tip, texts);
  let box = null, model = null, pixels = {width: 260, height: 160};
  new ResizeObserver(([found]) => { if (found.contentRect.width) pixels = found.contentRect; }).observe(svg);

  /** The part of the world that is shown grows when something leaves it, and never shrinks. */
  function fit(places, margin) {
    for (const [x, y, r = 0] of places) {
      if (x - r < box[0]) box[0] = x - r - margin;
      if (y - r < box[1]) box[1] = y - r - margin;
      if (x + r > box[2]) box[2] = x + r + margin;
      if (y + r > box[3]) box[3] = y + r + margin;
    }
  }

  function draw(scene) {
    const far = reach(scene.model), seen = look(scene, far), project = seen.project;
    if (model !== scene.model) { model = scene.model; box = seen.box.map(one => one * far); }
    const solids = seen.chain.parts.map(({kind, axis, matrix, from, to, r}, at) => {
      const a = seen.solid(place(matrix, from)), b = seen.solid(place(matrix, to));
      return {at, kind, axis, r, a, b, round: distance(a, b) < distance(from, to) * .3};
    });
    const end = seen.solid(origin(seen.chain.tool)), dots = scene.points.map(point => ({at: project(point.at), name: point.name}));
    fit([...solids.flatMap(({a, b, r}) => [[...a, r[0]], [...b, r[1]]]), ...dots.map(dot => dot.at), ...scene.path.map(project)], far * .06);
    const [left, top, right, bottom] = box, size = FONT * Math.max((bottom - top) / pixels.height, (right - left) / pixels.width);
    put(svg, {viewBox: [left, top, right - left, bottom - top].map(one => one.toFixed(1)).join(" "), "font-size": size, "aria-label": name + ": " + seen.words});
    put(ring, {r: seen.ring ? far : 0});
    put(ground, {d: seen.floor === undefined ? "" : `M${left - far * 2} ${seen.floor}H${right + far * 2}`});
    list(parts, solids, one => one.at, () => makeSvg("path"), (element, {kind, axis, a, b, r, round}) => {
      put(element, {class: kind + (scene.near[axis] ? " near" : ""), d: outline(a, r[0], b, r[1], kind === "hub" || kind === "metal", round)});
    });
    put(tip, {cx: end[0], cy: end[1], r: size / 4});
    for (const [element, places] of [[path, scene.path], [trace, scene.trace]]) put(element, {points: places.map(one => project(one).map(Math.round)).join(" ")});
    const systems = scene.frames.map(({name, matrix}) => ({name, matrix: name === "tool" ? seen.chain.tool : matrix}));
    list(axes, systems, one => one.name, () => makeSvg("g", {}, ...["x", "y", "z"].map(axis => makeSvg("line", {class: axis}))), (element, {matrix}) => {
      const from = seen.solid(origin(matrix));
      [0, 1, 2].forEach(axis => {
        const to = seen.solid(along(matrix, axis, size * 2.2));
        put(element.children[axis], {x1: from[0], y1: from[1], x2: to[0], y2: to[1]});
      });
    });
    const marks = systems.filter(one => one.name !== "tool").map(({name, matrix}) => ({name, system: true, at: seen.solid(origin(matrix))}));
    list(points, dots, one => one.name, () => makeSvg("circle", {class: "point"}), (element, {at}) => put(element, {cx: at[0], cy: at[1], r: size / 4}));
    const limbs = solids.map(({a, b, r}) => ({a, b, r: Math.max(...r)}));
    list(texts, labels([...dots, ...marks], size, limbs, box), one => one.name + one.system, one => makeSvg("text", {class: one.system ? "system" : "", "text-anchor": "middle", "dominant-baseline": "central"}), (element, {label, name}) => {
      put(element, {x: label[0], y: label[1]});
      say(element, name);
    });
  }
  return {element: make("figure", {}, svg, make("figcaption", {}, name)), draw};
}

const mm = value => fixed(value, 1) + " mm";

/** From above, X to the right. */
function top(scene) {
  const [x, y] = origin(scene.chain.tool), project = ([x, y]) => [x, -y];
  return {chain: scene.chain, project, solid: project, ring: true, box: scene.model.kind === "scara" ? [-.6, -.62, 1.1, .62] : [-.4, -.42, 1.02, .42],
    words: "tool at X " + mm(x) + ", Y " + mm(y) + ", joint 1 at " + fixed(scene.joints[0], 1) + "\u00b0"};
}

/** From the side: of a six-axis arm the vertical plane it is in, of a SCARA its links in one line. */
function side(scene) {
  const {model, joints, tool} = scene, height = mm(origin(scene.chain.tool)[2]), low = floor(model, tool);
  if (model.kind === "scara") {
    const stretched = joints.map((one, axis) => axis < 2 ? 0 : one), project = ([, , z]) => [reach(model), -z], room = model.axes[2].max - low;
    return {chain: chain(model, stretched, tool), project, solid: ([x, , z]) => [x, -z], floor: -low, box: [-.35, -room / reach(model) * 1.4, 1.3, (20 - low) / reach(model)],
      words: "links stretched in one line, tool at height Z " + height + ", axis 3 at " + mm(joints[2])};
  }
  const angle = joints[0] * Math.PI / 180, c = Math.cos(angle), s = Math.sin(angle), ahead = ([x, y]) => x * c + y * s;
  // A point beside the plane is drawn at its own radius: so a taught point stays in place while the arm turns towards it.
  const project = point => [Math.hypot(point[0], point[1]) * (ahead(point) < 0 ? -1 : 1), -point[2]];
  return {chain: scene.chain, project, solid: point => [ahead(point), -point[2]], floor: -low, box: [-.4, -.85, 1, .09],
    words: "tool " + mm(ahead(origin(scene.chain.tool))) + " in front of axis 1, at height Z " + height};
}

/** The axes within their limits; T of a SCARA is part of its position. */
function makeJoints() {
  const rows = make("ul", {class: "joints", "aria-label": "Joints"});
  return {element: rows, draw({model, joints, near}) {
    list(rows, joints.map((one, at) => at), at => at, () => make("li", {}, make("b"), make("span", {class: "mono"}), make("span", {class: "bar", role: "meter"}, make("i")), make("small")));
    [...rows.children].forEach((row, at) => {
      const [label, value, bar, note] = row.children, axis = model.axes[at], words = fixed(joints[at], 2) + unit(model, at);
      say(label, "J" + (at + 1));
      say(value, words);
      say(note, near[at] ? "near " + near[at] : "");
      mark(row, "data-near", near[at]);
      for (const [key, found] of [["label", "Joint " + (at + 1)], ["valuemin", axis.min], ["valuemax", axis.max], ["valuenow", fixed(joints[at], 2)],
        ["valuetext", words + ", limits " + axis.min + " and " + axis.max + (near[at] ? ", near the " + near[at] + "imum" : "")]]) mark(bar, "aria-" + key, found);
      bar.firstChild.style.left = (100 * Math.min(1, Math.max(0, (joints[at] - axis.min) / (axis.max - axis.min)))).toFixed(1) + "%";
    });
  }};
}

/** The position of the tool in world and in work. */
function makePosition() {
  const rows = make("tbody"), work = make("th", {scope: "col"}, "Work");
  const element = make("table", {class: "position", "aria-label": "Position of the tool, mm and degrees"},
    make("thead", {}, make("tr", {}, make("td"), make("th", {scope: "col"}, "World"), work)), rows);
  return {element, name: word => say(work, word ? "Work " + word : "Work"), draw({model, world, work}) {
    list(rows, names(model), one => one, one => make("tr", {}, make("th", {scope: "row"}, one), make("td", {class: "number"}), make("td", {class: "number"})));
    [...rows.children].forEach((row, at) => {
      say(row.children[1], fixed(world[at], 2));
      say(row.children[2], fixed(work[at], 2));
    });
  }};
}

export function create(robot) {
  const room = make("div", {class: "space", hidden: true});
  const flat = [makePicture("Top", top), makePicture("Side", side)], joints = makeJoints(), position = makePosition();
  const pictures = make("div", {class: "pictures", hidden: true}, ...flat.map(one => one.element));
  const state3d = make("button", {type: "button", class: "toggle", "aria-pressed": "false", title: "In 3D, or from the top and from the side", onclick: () => setSpace(!wanted)}, "3D");
  const element = make("div", {class: "arm"}, room, pictures, state3d, 
    make("details", {class: "axes", open: !SMALL.matches}, make("summary", {}, "Axes and position"), make("div", {class: "values"}, joints.element, position.element)));
  let picture = null, points = [], trace = [], since = [], shown = false, wanted, space = null, seen = "", before = null, readAt, file = "", own = new Map();

  function draw() {
    const {arm} = robot.state, {model, tool} = picture, posture = chain(model, arm.joints, tool);
    const near = arm.joints.map((joint, at) => limit(model.axes[at], joint)), at = origin(posture.tool), last = trace.at(-1);
    if (LOCKED) leave(at);
    else if (arm.moving && (!last || distance(at, last) > STEP)) {
      trace.push(at);
      if (trace.length > TRACE) trace.shift();
    }
    // Of coordinate systems at one place the first is drawn.
    const base = frame(picture.base), frames = [];
    for (const [name, matrix] of [["world", IDENTITY], ["base", base], ["work", times(base, frame(picture.work_frame))], ["tool", posture.tool]])
      if (!frames.some(one => distance(one.matrix, matrix) < 1e-3)) frames.push({name, matrix});
    const scene = {...picture, joints: arm.joints, world: arm.world, work: arm.work, chain: posture, near, trace, points, frames};
    for (const part of [...pictures.hidden ? [] : flat, joints, position]) part.draw(scene);
    if (wanted) space?.draw(scene);
  }

  /** Of a recorded run the path is that of the last seconds; after a jump there is none. */
  function leave(at) {
    const {t} = robot.state;
    if (!robot.continues) [trace, since] = [[], []];
    if (!trace.length || distance(at, trace.at(-1)) > STEP) {
      trace.push(at);
      since.push(t);
    }
    const old = Math.max(trace.length - TRACE, since.findIndex(one => one >= t - robot.tail));
    if (old > 0) [trace, since] = [trace.slice(old), since.slice(old)];
  }

  /** Reads what a picture needs besides the pose. */
  async function read() {
    readAt = robot.moment;
    try {
      const found = await robot.get("arm");
      // The model is kept, so that it can be told from another one by its identity.
      if (picture && JSON.stringify(picture.model) === JSON.stringify(found.model)) found.model = picture.model;
      if (!found.path.length && picture && !LOCKED) found.path = picture.path;
      if (picture && found.t < picture.t && !LOCKED) [trace, found.path] = [[], []];
      picture = found;
    } catch { seen = ""; }
  }

  /** The positions of the selected file, in world. */
  function taught(state) {
    const systems = new Map(state.variables.filter(one => one.kind === "coordinate" && !one.bounds.length).map(one => [one.name.toUpperCase(), one.value]));
    const base = frame(picture.base), found = state.variables.filter(one => one.kind === "position" && !one.name.includes(".") && !one.bounds.length && one.value?.every(Number.isFinite));
    return found.slice(0, POINTS).map(({name, value}) => {
      const work = systems.get(own.get(name.toUpperCase())) ?? picture.work_frame;
      return {name, at: place(times(base, system(picture.model, work)), value)};
    });
  }

  async function setSpace(on) {
    wanted = on;
    mark(state3d, "aria-pressed", on);
    room.hidden = !on;
    pictures.hidden = on && !TALL.matches;
    try {
      if (on) space ??= (await load("arm3d.js")).create(room);
    } catch (error) {
      console.warn(error);
      state3d.disabled = true;
      say(state3d, "3D needs WebGL2");
      return setSpace(false);
    }
    if (picture) draw();
  }

  async function look(state) {
    const {arm} = state, begun = arm.moving && before && (!before.moving || arm.percent < before.percent);
    before = arm;
    if (state.file !== file) {
      file = state.file;
      own = new Map();
    }
    if (robot.lines.length && !own.size) own = works(robot.lines.join("\n"));
    const key = arm.moving ? "moving" : JSON.stringify([arm, state.file]), old = !begun && key === seen;
    seen = key;
    // While the moment is dragged its motions change too fast to be read.
    if (robot.busy && picture) {
      if (!robot.playing) picture.path = [];
      if (!robot.playing || !begun) return redraw();
    }
    // Drawn at once, with the same pose as everything else; what is read now is drawn when it is there.
    redraw();
    if (old) return;
    await read();
    redraw();
  }

  function redraw() {
    if (!picture) return;
    points = taught(robot.state);
    draw();
  }

  TALL.addEventListener("change", () => setSpace(wanted));
  robot.on("settled", moment => {
    if (!shown || moment === readAt) return;
    seen = "";
    look(robot.state);
  });
  return {
    element: ifKnown(robot, ["arm"], element, "Arm"),
    state(state) {
      position.name(state.arm.work_name);
      if (shown) look(state);
    },
    pose(state) { if (picture) look(state); },
    show() {
      shown = true;
      seen = "";
      if (wanted === undefined) setSpace(true);
      if (robot.state) look(robot.state);
    },
    hide() { shown = false; },
  };
}
