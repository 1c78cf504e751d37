// Where the moments of a recorded run lie on its timeline, and the lanes with what happened.
//
// A reset or a restored snapshot begins another count of time, an epoch: the epochs lie side by side on one axis, with a gap
// between them. Places on the axis are in microseconds. Items are kept as they came, since a run may have a million.

const GAP = .012;        // between two epochs, as a part of the whole
const SHORTEST = 1000;   // room of an epoch on the axis

/** The number of the first of `length` for which `passes` holds; it holds for all after it. */
export function firstOf(length, passes) {
  let low = 0, high = length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (passes(middle)) high = middle; else low = middle + 1;
  }
  return low;
}

export class Axis {
  constructor(epochs) {
    this.epochs = epochs;
    const lengths = epochs.map(({begins, ends}) => Math.max(SHORTEST, ends - begins)), whole = lengths.reduce((sum, one) => sum + one, 0);
    this.gap = epochs.length > 1 ? whole * GAP : 0;
    this.starts = [];
    let at = 0;
    for (const length of lengths) {
      this.starts.push(at);
      at += length + this.gap;
    }
    this.lengths = lengths;
    this.total = Math.max(SHORTEST, at - this.gap);
  }

  /** The epoch of an event. */
  epochOf(event) { return Math.max(0, firstOf(this.epochs.length, at => this.epochs[at].event > event) - 1); }

  /** The place of a time of an epoch. */
  place(epoch, t) { return this.starts[epoch] + Math.min(this.lengths[epoch], Math.max(0, t - this.epochs[epoch].begins)); }

  /** The end of the epoch of a place. */
  end(place) {
    const epoch = Math.max(0, firstOf(this.starts.length, at => this.starts[at] > place) - 1);
    return this.starts[epoch] + this.lengths[epoch];
  }

  /** The epoch and the time at a place. */
  at(place) {
    const epoch = Math.max(0, firstOf(this.starts.length, at => this.starts[at] > place) - 1), {begins, ends} = this.epochs[epoch];
    return {epoch, t: Math.round(Math.min(ends, begins + Math.max(0, place - this.starts[epoch])))};
  }
}

const LEVELS = ["", "note", "warning", "error"];

/** Marks or spans of a lane in their order, with the places that are drawn. */
class Items {
  constructor(items, axis) {
    const places = items.map(([event, t]) => axis.place(axis.epochOf(event), t)), order = places.map((_, at) => at);
    const before = (one, other) => places[one] - places[other] || items[one][0] - items[other][0];
    // They usually come in their order.
    if (order.some((at, next) => next && before(at, order[next - 1]) < 0)) order.sort(before);
    this.items = order.map(at => items[at]);
    this.from = Float64Array.from(order, at => places[at]);
    this.level = Uint8Array.from(this.items, item => LEVELS.indexOf(item[2]));
    this.to = Float64Array.from(this.items, (item, at) => {
      if (item.length < 6) return this.from[at];
      const epoch = axis.epochOf(item[4]), end = axis.place(epoch, item[5]);
      // What ends with an epoch does not reach over the gap.
      return epoch > axis.epochOf(item[0]) && end === axis.starts[epoch] ? end - axis.gap : end;
    });
  }

  get length() { return this.items.length; }

  /** The number of the first item after a place and an event. */
  after(place, event) {
    return firstOf(this.length, at => this.from[at] > place || this.from[at] === place && this.items[at][0] > event);
  }

  /** The number of the first item at or after a place and an event. */
  since(place, event) {
    return firstOf(this.length, at => this.from[at] > place || this.from[at] === place && this.items[at][0] >= event);
  }
}

/** One lane. */
export class Lane {
  constructor({id, title, left_out: leftOut, items}, axis) {
    Object.assign(this, {id, title, leftOut, axis});
    this.marks = new Items(items.filter(item => item.length < 6), axis);
    this.spans = new Items(items.filter(item => item.length >= 6), axis);
  }

  /** The item after a moment, or before it. */
  step(moment, forward) {
    const place = this.axis.place(moment.epoch, moment.t), found = [this.marks, this.spans].map(one => {
      const at = forward ? one.after(place, moment.e) : one.since(place, moment.e) - 1;
      return one.items[at] && {item: one.items[at], place: one.from[at]};
    }).filter(one => one);
    found.sort((one, other) => (one.place - other.place || one.item[0] - other.item[0]) * (forward ? 1 : -1));
    return found[0]?.item;
  }

  /** The items around a moment, at most so many on each side. */
  near(moment, count) {
    const place = this.axis.place(moment.epoch, moment.t);
    return [this.marks, this.spans].flatMap(one => {
      const at = one.after(place, moment.e);
      return one.items.slice(Math.max(0, at - count), at + count);
    });
  }

  /** The span that a moment lies in. */
  within(moment) {
    const place = this.axis.place(moment.epoch, moment.t), at = this.spans.after(place, moment.e) - 1;
    return at >= 0 && (place < this.spans.to[at] || this.spans.to[at] === this.axis.total) ? this.spans.items[at] : undefined;
  }

  /** The numbers of the last event known to be before a place or at it, and of the first after it. */
  bounds(place) {
    let last = 0, next = Infinity;
    for (const one of [this.marks, this.spans]) {
      const at = one.after(place, Infinity);
      if (at > 0) last = Math.max(last, one.items[at - 1][0]);
      if (at < one.length) next = Math.min(next, one.items[at][0]);
    }
    return [last, next];
  }
}

/** The moment of an item, or of `[event, t, ...]` of a list. */
export const momentOf = ([event, t], axis) => ({e: event, t, epoch: axis.epochOf(event)});
