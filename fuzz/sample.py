#!/usr/bin/env python3
"""Copies a sample of a target's inputs into a folder: those that together reach most for what they take of the bounds.

    sample.py CONTROL FOLDER

CONTROL is the control file of a merge by libFuzzer with -set_cover_merge=1: the inputs, and the features that each reaches."""
import heapq
import os
import pathlib
import shutil
import sys

# Of a target. tests/suites/fuzzing.rs holds what is committed for all of them to its own bounds.
MOST_INPUTS, MOST_BYTES = 120, 28_000


def inputs(control):
    """Path, size and features of each input that ran to its end."""
    with control.open() as lines:
        count = int(next(lines))
        next(lines)
        paths = [next(lines).rstrip("\n") for _ in range(count)]
        for line in lines:
            kind, at, *rest = line.split()
            if kind == "FT":
                yield paths[int(at)], os.path.getsize(paths[int(at)]), set(map(int, rest))


def chosen(some):
    """The paths of the sample, and all features that it reaches. The next is always the one with most new features for its share of both bounds."""
    shares = [size / MOST_BYTES + 1 / MOST_INPUTS for _, size, _ in some]
    # What an input adds only falls as others are chosen: the first of the heap is the best if its value is still the first.
    best = [(-len(features) / share, at) for at, ((_, _, features), share) in enumerate(zip(some, shares))]
    heapq.heapify(best)
    paths, total, reached = [], 0, set()
    while best and len(paths) < MOST_INPUTS:
        _, at = heapq.heappop(best)
        path, size, features = some[at]
        value = -len(features - reached) / shares[at]
        if not value or total + size > MOST_BYTES:
            continue
        if best and value > best[0][0]:
            heapq.heappush(best, (value, at))
            continue
        paths.append(path)
        total += size
        reached |= features
    return paths, reached


def main(control, folder):
    some = list(inputs(pathlib.Path(control)))
    paths, reached = chosen(some)
    for path in paths:
        shutil.copy(path, folder)
    print("%d inputs of %d, with %d features of %d" % (len(paths), len(some), len(reached), len(set().union(*(features for _, _, features in some)))))


if __name__ == "__main__":
    main(*sys.argv[1:])
