// Places the names of points and coordinate systems in a picture: beside what they name, never on the arm or on one another.

import {distance} from "./links.js";

const LONGEST = 22;    // characters of a label
const WIDE = .56;      // width of a character, in heights of the font
const AROUND = 16;     // directions in which a place is looked for
const FAR = 12;        // distances at which it is looked for, each one height of the font further

/** Distance of a point from a line between two others. */
function away([x, y], [x1, y1], [x2, y2]) {
  const long = (x2 - x1) ** 2 + (y2 - y1) ** 2, share = long ? Math.max(0, Math.min(1, ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / long)) : 0;
  return Math.hypot(x - x1 - share * (x2 - x1), y - y1 - share * (y2 - y1));
}

/** Whether a box about a point touches a limb: its middle line, looked at in three places, is nearer than the limb is thick. */
const touches = ([x, y], w, h, {a, b, r}) => [-w / 2, 0, w / 2].some(dx => away([x + dx, y], a, b) < r + h / 2);

const overlap = (one, other) => Math.abs(one.label[0] - other.label[0]) < (one.w + other.w) / 2 && Math.abs(one.label[1] - other.label[1]) < (one.h + other.h) / 2;

/**
 * The labels of `items` (`{name, at, system}`), each with `label`, the middle of its text. Points that would have one place share it. `size` is
 * the height of the font, `limbs` are those of the arm (`{a, b, r}`), `box` is the picture: left, top, right, bottom.
 */
export function labels(items, size, limbs, [left, top, right, bottom]) {
  const joined = [];
  for (const item of items) {
    const near = joined.find(({at, system}) => system === item.system && distance(at, item.at) < size);
    if (near) near.name += ", " + item.name; else joined.push({...item});
  }
  const placed = [];
  for (const one of joined) {
    if (one.name.length > LONGEST) one.name = one.name.slice(0, LONGEST - 1) + "\u2026";
    [one.w, one.h] = [one.name.length * WIDE * size, size];
    for (let far = 1; far <= FAR && !one.label; far += 1)
      for (let turn = 0; turn < AROUND && !one.label; turn += 1) {
        const angle = -.8 + turn * 2 * Math.PI / AROUND, x = one.at[0] + Math.cos(angle) * (far * size + one.w / 2), y = one.at[1] + Math.sin(angle) * far * size;
        if (x - one.w / 2 < left || x + one.w / 2 > right || y - size / 2 < top || y + size / 2 > bottom) continue;
        if (limbs.some(limb => touches([x, y], one.w, size, limb)) || placed.some(other => overlap({...one, label: [x, y]}, other))) continue;
        one.label = [x, y];
      }
    // Without a free place it is left out: the arm matters more.
    if (one.label) placed.push(one);
  }
  return placed;
}
