// Forward kinematics of both kinds of arm, as motion/kinematics of the controller has it, and the shapes of its links.
//
// Lengths are mm, angles degrees. A matrix is an array of 16 numbers, column after column, as WebGL takes it.

export const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
// At A = B = C = 0 the tool looks down, while the flange looks along its Z axis.
const FLIP = [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1];

export function times(a, b) {
  const out = new Array(16);
  for (let column = 0; column < 16; column += 4)
    for (let row = 0; row < 4; row += 1)
      out[column + row] = a[row] * b[column] + a[4 + row] * b[column + 1] + a[8 + row] * b[column + 2] + a[12 + row] * b[column + 3];
  return out;
}

export const move = (x, y, z) => [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1];

/** A turn about an axis: 0 is X, 1 is Y, 2 is Z. */
export function turn(axis, degrees) {
  const c = Math.cos(degrees * Math.PI / 180), s = Math.sin(degrees * Math.PI / 180);
  if (axis === 0) return [1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, 0, 0, 0, 1];
  if (axis === 1) return [c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, 0, 0, 0, 1];
  return [c, s, 0, 0, -s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
}

/** The coordinate system X Y Z A B C: Rz(C) Ry(B) Rx(A), then the displacement. */
export function frame([x, y, z, a = 0, b = 0, c = 0]) {
  return [move(x, y, z), turn(2, c), turn(1, b), turn(0, a)].reduce(times);
}

/** A point of a coordinate system in the one that system is given in. */
export function place(m, [x, y, z]) {
  return [0, 1, 2].map(row => m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]);
}

export const origin = m => m.slice(12, 15);

/** The end of an arrow of this length along an axis of a coordinate system. */
export const along = (m, axis, long) => origin(m).map((one, row) => one + m[axis * 4 + row] * long);

export const minus = (a, b) => a.map((one, at) => one - b[at]);
export const distance = (a, b) => Math.hypot(...minus(a, b));

/** Longest distance between axis 1 and the flange, sideways. */
export function reach({kind, geometry: g}) {
  if (kind === "scara") return Math.abs(g.first_arm) + Math.abs(g.second_arm);
  return [g.shoulder_offset, g.upper_arm, Math.hypot(g.elbow_offset, g.forearm), g.flange].reduce((sum, one) => sum + Math.abs(one), 0);
}

/** Height of the floor: a SCARA is mounted on a column, so that its shaft has room. */
export function floor({kind, axes}, tool = [0, 0, 0]) {
  return kind === "scara" ? axes[2].min + Math.min(0, tool[2]) - 30 : 0;
}

/**
 * The arm in a posture. It is at the origin of world: BASE moves the positions, not the arm. `flange` and `tool` are
 * matrices in world. `parts` are its solids, foot first: each lies in the coordinate system `matrix`, goes `from` one
 * point `to` another with the radii `r`, and belongs to an axis (from 0; -1 is the foot). It is a `limb` (rounded
 * ends), a `hub` (flat ends, about the axis of a joint), `metal` or the `tool`.
 */
export function chain(model, joints, tool) {
  const g = model.geometry, root = IDENTITY, parts = [];
  const add = (axis, kind, matrix, from, to, r, r2 = r) => parts.push({axis, kind, matrix, from, to, r: [r, r2]});
  let flange;
  if (model.kind === "scara") {
    const u = reach(model) / 400, low = floor(model, tool), high = model.axes[2].max + 60 * u, upper = high + 62 * u;
    const first = times(root, turn(2, joints[0]));
    const second = [first, move(g.first_arm, 0, 0), turn(2, joints[1])].reduce(times);
    flange = [second, move(g.second_arm, 0, joints[2]), turn(2, joints[3])].reduce(times);
    add(-1, "metal", root, [0, 0, low], [0, 0, low + 16 * u], 88 * u);
    add(-1, "hub", root, [0, 0, low + 16 * u], [0, 0, high - 36 * u], 58 * u);
    add(0, "hub", first, [0, 0, high - 44 * u], [0, 0, high + 34 * u], 56 * u);
    add(0, "limb", first, [0, 0, high], [g.first_arm, 0, high], 38 * u, 30 * u);
    add(1, "hub", second, [0, 0, high - 30 * u], [0, 0, upper + 40 * u], 40 * u);
    add(1, "limb", second, [0, 0, upper], [g.second_arm, 0, upper], 34 * u, 27 * u);
    add(2, "hub", second, [g.second_arm, 0, upper - 42 * u], [g.second_arm, 0, upper + 48 * u], 29 * u);
    add(2, "metal", flange, [0, 0, 14 * u], [0, 0, upper - model.axes[2].min + 60 * u], 10 * u);
    add(3, "metal", flange, [0, 0, 0], [0, 0, 16 * u], 19 * u);
  } else {
    const u = (Math.abs(g.upper_arm) + Math.abs(g.forearm)) / 750, h = g.shoulder_height;
    const first = times(root, turn(2, joints[0]));
    const second = [first, move(g.shoulder_offset, 0, h), turn(1, joints[1])].reduce(times);
    const third = [second, move(0, 0, g.upper_arm), turn(1, joints[2])].reduce(times);
    const fourth = [third, move(g.elbow_offset, 0, g.forearm), turn(2, joints[3])].reduce(times);
    const fifth = times(fourth, turn(1, joints[4]));
    const sixth = times(fifth, turn(2, joints[5]));
    flange = [sixth, move(0, 0, g.flange), FLIP].reduce(times);
    const split = g.forearm * .42;
    add(-1, "metal", root, [0, 0, 0], [0, 0, 18 * u], 128 * u);
    add(-1, "hub", root, [0, 0, 18 * u], [0, 0, h * .36], 92 * u);
    add(0, "limb", first, [0, 0, h * .48], [g.shoulder_offset, 0, h], 84 * u, 66 * u);
    add(1, "hub", second, [0, -84 * u, 0], [0, 84 * u, 0], 66 * u);
    add(1, "limb", second, [0, 0, 0], [0, 0, g.upper_arm], 56 * u, 47 * u);
    add(2, "hub", third, [0, -66 * u, 0], [0, 66 * u, 0], 53 * u);
    add(2, "limb", third, [0, 0, 0], [g.elbow_offset, 0, split], 46 * u, 43 * u);
    add(3, "metal", fourth, [0, 0, split - g.forearm - 5 * u], [0, 0, split - g.forearm + 5 * u], 45 * u);
    add(3, "limb", fourth, [0, 0, split - g.forearm], [0, 0, 0], 40 * u, 32 * u);
    add(4, "hub", fifth, [0, -44 * u, 0], [0, 44 * u, 0], 36 * u);
    add(4, "limb", fifth, [0, 0, 0], [0, 0, g.flange * .5], 31 * u, 29 * u);
    add(5, "metal", sixth, [0, 0, g.flange * .72], [0, 0, g.flange], 34 * u);
  }
  const end = times(flange, frame(tool)), long = Math.hypot(...tool.slice(0, 3)), thick = reach(model) / 90;
  if (long > 1) add(joints.length, "tool", flange, [0, 0, 0], tool.slice(0, 3), thick, thick / 3);
  return {flange, tool: end, parts};
}
