// SPDX-License-Identifier: Apache-2.0
// The points of a long line that can be seen: of those that share a column of pixels, the first, the last, the smallest
// and the largest of every line.

export type Values = ArrayLike<number | null>;

/** The first index with times[i] >= time. */
export function lowerBound(times: ArrayLike<number>, time: number): number {
  let low = 0;
  let high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < time) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  return low;
}

/** A line as it is drawn: `undefined` where another line has a point that this one can do without. */
type Drawn = (number | null | undefined)[];

/** The times and the lines between `from` and `to`, reduced to what can be seen on `columns` columns. */
export function decimate(
  times: ArrayLike<number>,
  lines: Values[],
  from: number,
  to: number,
  columns: number,
): [number[], ...Drawn[]] {
  // One point beyond either end, so that lines reach the edge.
  const begin = Math.max(0, lowerBound(times, from) - 1);
  const end = Math.min(times.length, lowerBound(times, to) + 2);
  const shownTimes: number[] = [];
  const drawn = lines.map((): Drawn => []);
  const few = end - begin <= 4 * columns;
  const width = (to - from) / columns;
  const least = lines.map(() => 0);
  const most = lines.map(() => 0);
  for (let start = begin; start < end; ) {
    let stop = start + 1;
    const column = Math.floor((times[start] - from) / width);
    while (!few && stop < end && Math.floor((times[stop] - from) / width) === column) ++stop;
    lines.forEach((line, l) => {
      [least[l], most[l]] = extremes(line, start, stop);
    });
    const keep = new Set([start, stop - 1, ...least, ...most]);
    for (const i of [...keep].sort((a, b) => a - b)) {
      shownTimes.push(times[i]);
      const isEnd = i === start || i === stop - 1;
      lines.forEach((line, l) => {
        const value = isEnd || i === least[l] || i === most[l] ? line[i] : undefined;
        drawn[l].push(Number.isNaN(value) ? null : value);
      });
    }
    start = stop;
  }
  return [shownTimes, ...drawn];
}

/** Where `line` is smallest and largest, from index `start` to before `stop`. */
function extremes(line: Values, start: number, stop: number): [number, number] {
  let least = start;
  let most = start;
  let low = Infinity;
  let high = -Infinity;
  for (let i = start; i < stop; ++i) {
    const value = line[i];
    if (value === null) continue;
    if (value < low) [least, low] = [i, value];
    if (value > high) [most, high] = [i, value];
  }
  return [least, most];
}
