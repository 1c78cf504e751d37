// The robot in 3D, by WebGL2: its links, the floor with a shadow, coordinate systems, path and taught points.
//
// A frame is drawn when something has changed, and while the arm is on its way from one posture that was read to the next.
// After each frame the canvas dispatches `drawn`, and `data-frames` is their number.

import {labels} from "./labels.js";
import {fixed, list, make, mark, say} from "./dom.js";
import {along, chain, distance, floor, minus, move, origin, place, reach, times, turn} from "./links.js";

const SIZE = 1600;        // pixels of the longer side of the picture at most
const DENSITY = 2;        // pixels of the picture for one of the page at most
const SHADOW = 1024;      // pixels of a side of the shadow's picture
const LATE = 120;         // a posture that was read later than this after the last is shown at once, in ms
const ROUND = 26;         // flat sides of what is round
const BEND = 5;           // steps of a rounded edge
const VIEWS = {Home: [-52, 20], Front: [0, 8], Side: [-90, 8], Top: [-90, 90]};
const FOV = 26;
const FONT = 13;          // height of the labels in pixels
const KEYS = 40;          // height of the keys above the picture, where no label is
const SUN = [-115, 52];

const VARYING = `#version 300 es
precision highp float; precision highp sampler2DShadow;`;
const LIT = `uniform mat4 light; uniform sampler2DShadow shade;
float lit(vec3 at) {
  vec3 q = (light * vec4(at, 1)).xyz * .5 + .5;
  float sum = 0.;
  for (int x = 0; x < 2; x++) for (int y = 0; y < 2; y++) sum += texture(shade, q + vec3(vec2(x, y) * 1.6 - .8, -.8) / 1024.);
  return sum / 4.;
}`;
const SOLID = [`${VARYING}
layout(location = 0) in vec3 p; layout(location = 1) in vec3 n; layout(location = 2) in float t;
uniform mat4 model, view; out vec3 at, normal; out float along;
void main() { vec4 q = model * vec4(p, 1); at = q.xyz; normal = mat3(model) * n; along = t; gl_Position = view * q; }`, `${VARYING}
in vec3 at, normal; in float along; uniform vec3 eye, sun, body, cap; uniform float gloss, band; out vec4 colour; ${LIT}
void main() {
  vec3 n = normalize(normal), e = normalize(eye - at);
  float end = abs(along - .5) * 2., w = max(fwidth(end), 1e-4);
  vec3 c = mix(body, cap, smoothstep(band - w, band + w, end)) * (1. - .75 * smoothstep(2. * w, w, abs(end - band)) * step(band, 1.));
  c = pow(c, vec3(2.2));
  float s = max(dot(n, sun), 0.) * lit(at + n * 4.), sky = .5 + .5 * n.z;
  c *= .2 + .35 * sky + .75 * s + .12 * max(dot(n, e), 0.);
  c = c * (.55 + .45 * smoothstep(0., .6, dot(n, e))) + gloss * s * pow(max(dot(n, normalize(e + sun)), 0.), 48.);
  colour = vec4(pow(c, vec3(1. / 2.2)), 1);
}`];
const FLOOR = [`${VARYING}
layout(location = 0) in vec3 p; uniform mat4 view; uniform float far, low; out vec3 at;
void main() { at = vec3(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2. - 1., 0) * far * 3. + vec3(0, 0, low); gl_Position = view * vec4(at, 1); }`, `${VARYING}
in vec3 at; uniform vec3 body, ink; uniform float far; out vec4 colour; ${LIT}
float grid(float step) { vec2 g = at.xy / step, d = abs(fract(g - .5) - .5) / fwidth(g); return 1. - min(min(d.x, d.y), 1.); }
void main() {
  float r = length(at.xy), lines = max(grid(100.) * .16, grid(500.) * .4);
  lines = max(lines, .5 * (1. - min(abs(r - far) / fwidth(r) / 1.2, 1.)));
  float dark = .5 * (1. - lit(at)) + .25 * exp(-r * r / far / far * 40.);
  float a = 1. - smoothstep(far * .9, far * 2.6, r);
  colour = vec4(mix(body, ink, lines) * (1. - dark), 1) * a;
}`];
const LINE = [`${VARYING}
layout(location = 0) in vec3 a; layout(location = 1) in vec3 b; layout(location = 2) in vec4 c;
uniform mat4 view; uniform vec2 size; uniform float alpha; out vec4 ink;
void main() {
  vec4 A = view * vec4(a, 1), B = view * vec4(b, 1), q = gl_VertexID < 2 ? A : B;
  vec2 d = (B.xy / B.w - A.xy / A.w) * size;
  d = length(d) > 0. ? normalize(d) : vec2(1, 0);
  q.xy += vec2(-d.y, d.x) * c.a / size * (gl_VertexID % 2 == 0 ? 1. : -1.) * q.w;
  q.z -= .001 * q.w; ink = vec4(c.rgb, 1) * alpha; gl_Position = q;
}`, `${VARYING}
in vec4 ink; out vec4 colour; void main() { colour = ink; }`];

function compile(gl, sources) {
  const program = gl.createProgram(), at = {};
  sources.forEach((source, index) => {
    const shader = gl.createShader(index ? gl.FRAGMENT_SHADER : gl.VERTEX_SHADER);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost())
    throw new Error(gl.getProgramInfoLog(program) || gl.getAttachedShaders(program).map(one => gl.getShaderInfoLog(one)).join());
  return {program, set(values) {
    for (const [name, value] of Object.entries(values)) {
      const place = at[name] ??= gl.getUniformLocation(program, name);
      if (value.length === 16) gl.uniformMatrix4fv(place, false, value);
      else if (value.length) gl["uniform" + value.length + "fv"](place, value);
      else gl.uniform1f(place, value);
    }
  }};
}

/** The triangles of a solid of revolution along Z: place, normal, and how far along it is. */
function lathe(kind, long, r, r2) {
  const round = kind === "limb" || kind === "tool" || kind === "ball", edge = round ? 0 : Math.min(r * .22, long * .3), profile = [];
  const tilt = round && long ? Math.asin(Math.max(-1, Math.min(1, (r - r2) / long))) : 0;
  const arc = (radius, z, bend, from, to) => {
    for (let step = 0; step <= BEND; step += 1) {
      const angle = from + (to - from) * step / 8, c = Math.cos(angle), s = Math.sin(angle);
      profile.push([radius + bend * c, z + bend * s, c, s]);
    }
  };
  if (!round) profile.push([0, 0, 0, -1]);
  arc(round ? 0 : r - edge, edge, round ? r : edge, -Math.PI / 2, tilt);
  arc(round ? 0 : r2 - edge, long - edge, round ? r2 : edge, tilt, Math.PI / 2);
  if (!round) profile.push([0, long, 0, 1]);
  const out = [];
  const corner = ([radius, z, c, s], side) => {
    const angle = side * 2 * Math.PI / ROUND, x = Math.cos(angle), y = Math.sin(angle);
    out.push(radius * x, radius * y, z, c * x, c * y, s, long ? z / long : .5);
  };
  for (let at = 1; at < profile.length; at += 1)
    for (let side = 0; side < ROUND; side += 1) {
      const low = profile[at - 1], high = profile[at];
      corner(low, side); corner(low, side + 1); corner(high, side + 1);
      corner(low, side); corner(high, side + 1); corner(high, side);
    }
  return out;
}

/** Turns Z into the direction of `v`, and moves to `from`. */
function align(from, [x, y, z]) {
  return [move(...from), turn(2, Math.atan2(y, x) * 180 / Math.PI), turn(1, Math.atan2(Math.hypot(x, y), z) * 180 / Math.PI)].reduce(times);
}

/** The posture in words. */
const words = (tool, joints) => "tool at " + ["X", "Y", "Z"].map((axis, at) => axis + " " + fixed(tool[at], 1)).join(", ") + " mm, joint 1 at " + fixed(joints[0], 1);

const rotation = ([yaw, pitch]) => times(turn(0, pitch - 90), turn(2, -90 - yaw));
const direction = angles => { const m = rotation(angles); return [m[2], m[6], m[10]]; };

export function create(host) {
  const canvas = make("canvas", {tabindex: "0", role: "application", "aria-label": "Robot in 3D", title: "Drag to turn. Click, then use the wheel to zoom."});
  const names = make("div", {class: "names", "aria-hidden": "true"});
  const gl = canvas.getContext("webgl2", {antialias: true, preserveDrawingBuffer: true});
  if (!gl) throw new Error("WebGL2 is missing");
  const key = (label, name, press) => make("button", {type: "button", "aria-label": name, onclick: () => { press(); ask(); }}, label);
  const views = make("div", {class: "views", role: "group", "aria-label": "View"},
    ...Object.keys(VIEWS).map(name => key(name, name + " view", () => { angles = [...VIEWS[name]]; zoom = 1; })), make("i"),
    key("\u2212", "Zoom out", () => zoomBy(1.2)), key("+", "Zoom in", () => zoomBy(1 / 1.2)));

  let solid, ground, line, solids, lines, shadow, depth, meshes = [];
  let angles = [...VIEWS.Home], zoom = 1, scene = null, asked = 0, frames = 0, built = "", colours = {};
  let from = null, shown = null, since = 0, span = 0;

  /** Everything that lives in the context: made again when the context was lost. */
  function setup() {
    [solid, ground, line] = [SOLID, FLOOR, LINE].map(sources => compile(gl, sources));
    const attributes = (sizes, divisor) => {
      const array = gl.createVertexArray(), buffer = gl.createBuffer(), stride = sizes.reduce((sum, one) => sum + one, 0) * 4;
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      sizes.reduce((offset, size, at) => {
        gl.enableVertexAttribArray(at);
        gl.vertexAttribPointer(at, size, gl.FLOAT, false, stride, offset * 4);
        gl.vertexAttribDivisor(at, divisor);
        return offset + size;
      }, 0);
      return {array, buffer};
    };
    solids = attributes([3, 3, 1], 0);
    lines = attributes([3, 3, 4], 1);
    depth = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, depth);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.DEPTH_COMPONENT24, SHADOW, SHADOW);
    for (const [name, value] of [["COMPARE_MODE", gl.COMPARE_REF_TO_TEXTURE], ["MIN_FILTER", gl.LINEAR], ["MAG_FILTER", gl.LINEAR], ["WRAP_S", gl.CLAMP_TO_EDGE], ["WRAP_T", gl.CLAMP_TO_EDGE]])
      gl.texParameteri(gl.TEXTURE_2D, gl["TEXTURE_" + name], value);
    shadow = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, shadow);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depth, 0);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    built = "";
  }

  /** The triangles of all links, and of a ball for taught points. */
  function build(parts) {
    const all = [];
    meshes = [...parts.map(({kind, from, to, r}) => [kind, distance(from, to), ...r]), ["ball", 0, 1, 1]].map(one => {
      const first = all.length / 7;
      for (const value of lathe(...one)) all.push(value);
      return [first, all.length / 7 - first];
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, solids.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(all), gl.STATIC_DRAW);
  }

  function readColours() {
    const style = getComputedStyle(host);
    for (const name of ["solid", "edge", "joint", "metal", "ground", "soft", "accent", "bad", "near"]) {
      const value = style.getPropertyValue("--" + name).trim();
      colours[name] = [1, 3, 5].map(at => parseInt(value.slice(at, at + 2), 16) / 255);
    }
    ask();
  }

  function posture(now) {
    const share = span ? Math.min(1, (now - since) / span) : 1;
    shown = scene.joints.map((one, at) => from[at] + (one - from[at]) * share);
    return share < 1;
  }

  function frame(now) {
    asked = 0;
    const {width, height} = canvas.getBoundingClientRect();
    if (!scene || !width || gl.isContextLost()) return;
    const density = Math.min(devicePixelRatio, DENSITY, SIZE / Math.max(width, height)), w = Math.round(width * density), h = Math.round(height * density);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const goesOn = posture(now), {model} = scene, far = reach(model), low = floor(model, scene.tool), {parts, tool} = chain(model, shown, scene.tool);
    const wanted = JSON.stringify([model.geometry, scene.tool]);
    if (built !== wanted) { built = wanted; build(parts); }

    const high = model.kind === "scara" ? model.axes[2].max + far * .4 : far * .85, target = [far * .22, 0, low * .45 + high * .55];
    const away = zoom * Math.max((high - low) * 2.75, far * 2.3) * Math.max(1, 1.5 * height / width), t = 1 / Math.tan(FOV * Math.PI / 360), near = away * .1, end = away * 3 + far * 3;
    const project = [t * height / width, 0, 0, 0, 0, t, 0, 0, 0, 0, (near + end) / (near - end), -1, 0, 0, 2 * near * end / (near - end), 0];
    const view = [project, move(0, 0, -away), rotation(angles), move(...target.map(one => -one))].reduce(times);
    const eye = direction(angles).map((one, at) => target[at] + one * away), sun = direction(SUN), wide = 1 / (far * 1.35);
    const light = [[wide, 0, 0, 0, 0, wide, 0, 0, 0, 0, -wide / 1.5, 0, 0, 0, 0, 1], rotation(SUN), move(...target.map(one => -one))].reduce(times);

    const things = parts.map(({kind, axis, matrix, from, to, r}, at) => ({at, kind, r, long: distance(from, to), near: scene.near[axis], model: times(matrix, align(from, minus(to, from)))}));
    const drawSolids = lit => things.forEach(({at, kind, r, long, near, model}) => {
      solid.set({model});
      if (lit) solid.set({body: near && kind !== "metal" ? colours.near : colours[{limb: "solid", hub: "solid", metal: "metal", tool: "edge"}[kind]], cap: near ? colours.near : colours.joint,
        band: kind === "hub" ? 1 - 2 * Math.min(.19, .45 * r[0] / long) : 2, gloss: kind === "metal" ? .6 : .3});
      gl.drawArrays(gl.TRIANGLES, ...meshes[at]);
    });

    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(solids.array);
    gl.useProgram(solid.program);
    gl.bindFramebuffer(gl.FRAMEBUFFER, shadow);
    gl.viewport(0, 0, SHADOW, SHADOW);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    // The texture is not read while it is drawn: without this the two uses are in conflict.
    gl.bindTexture(gl.TEXTURE_2D, null);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(2, 4);
    solid.set({view: light});
    drawSolids(false);
    gl.disable(gl.POLYGON_OFFSET_FILL);

    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindTexture(gl.TEXTURE_2D, depth);
    solid.set({view, light, eye, sun});
    drawSolids(true);
    for (const {at} of scene.points) {
      solid.set({model: [far / 75, 0, 0, 0, 0, far / 75, 0, 0, 0, 0, far / 75, 0, ...at, 1], body: colours.accent, band: 2, gloss: .3});
      gl.drawArrays(gl.TRIANGLES, ...meshes.at(-1));
    }

    gl.enable(gl.BLEND);
    gl.useProgram(ground.program);
    ground.set({view, light, far, low, body: colours.ground, ink: colours.soft});
    gl.depthMask(false);
    gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);

    const data = [], through = (places, colour, thick) => places.forEach((one, at) => { if (at) data.push(...places[at - 1], ...one, ...colour, thick * density); });
    through(scene.trace, colours.accent, 2);
    through(scene.path, colours.bad, 1.2);
    for (const {name, matrix} of scene.frames) for (const axis of [0, 1, 2]) {
      const m = name === "tool" ? tool : matrix;
      through([origin(m), along(m, axis, far * .14)], [[.85, .2, .16], [.14, .6, .3], [.2, .45, .92]][axis], 1.6);
    }
    gl.useProgram(line.program);
    gl.bindVertexArray(lines.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, lines.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.DYNAMIC_DRAW);
    // What lies within or behind a link shines through it.
    for (const alpha of [.3, 1]) {
      if (alpha < 1) gl.disable(gl.DEPTH_TEST); else gl.enable(gl.DEPTH_TEST);
      line.set({view, size: [w, h], alpha});
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, data.length / 10);
    }
    gl.depthMask(true);

    const screen = ([x, y, z]) => {
      const depth = view[3] * x + view[7] * y + view[11] * z + view[15];
      return place(view, [x, y, z]).slice(0, 2).map((one, at) => (at ? 1 - one / depth : 1 + one / depth) / 2 * [width, height][at]);
    };
    const points = scene.points.map(({name, at}) => ({name, at: screen(at)}));
    const systems = scene.frames.filter(one => one.name !== "tool").map(({name, matrix}) => ({name, system: true, at: screen(origin(matrix))}));
    // The thickness of a link on the screen: how far apart two points are that are so far apart in the plane of the screen.
    const m = rotation(angles), across = [m[0], m[4], m[8]];
    const limbs = parts.map(({matrix, from, to, r}) => {
      const [p, q] = [place(matrix, from), place(matrix, to)], thick = Math.max(...r), a = screen(p);
      return {a, b: screen(q), r: distance(a, screen(p.map((one, at) => one + across[at] * thick)))};
    });
    list(names, labels([...points, ...systems], FONT, limbs, [0, KEYS, width, height]), one => one.name + one.system, one => make("span", {class: one.system ? "system" : ""}), (element, {label: [x, y], name}) => {
      say(element, name);
      element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
    });
    mark(canvas, "aria-label", "Robot in 3D, " + words(origin(tool), shown) + ". Arrow keys turn the view, plus and minus zoom.");
    frames += 1;
    mark(canvas, "data-frames", frames);
    canvas.dispatchEvent(new CustomEvent("drawn", {detail: frames}));
    if (goesOn) ask();
  }

  function ask() { if (!asked) asked = requestAnimationFrame(frame); }
  function zoomBy(factor) { zoom = Math.min(2.5, Math.max(.25, zoom * factor)); ask(); }
  function rotate(x, y) {
    angles = [angles[0] + x, Math.min(90, Math.max(1, angles[1] + y))];
    ask();
  }

  canvas.addEventListener("pointerdown", event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", event => { if (event.isPrimary && event.buttons & 1) rotate(-event.movementX * .4, event.movementY * .4); });
  // Without the focus the wheel scrolls the page.
  canvas.addEventListener("wheel", event => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    zoomBy(Math.exp(Math.sign(event.deltaY) * .12));
  }, {passive: false});
  canvas.addEventListener("keydown", event => {
    const turned = {ArrowLeft: [-6, 0], ArrowRight: [6, 0], ArrowUp: [0, 6], ArrowDown: [0, -6]}[event.key], zoomed = {"+": 1 / 1.2, "=": 1 / 1.2, "-": 1.2}[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey || !turned && !zoomed) return;
    if (turned) rotate(...turned); else zoomBy(zoomed);
    event.preventDefault();
  });
  canvas.addEventListener("webglcontextlost", event => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => { setup(); ask(); });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColours);
  new ResizeObserver(ask).observe(canvas);
  setup();
  host.append(canvas, names, views);
  readColours();

  return {draw(found) {
    const now = performance.now(), same = scene?.model === found.model && now - since < LATE;
    if (same) posture(now);
    from = same ? shown : found.joints;
    span = same ? now - since : 0;
    since = now;
    scene = found;
    ask();
  }};
}
