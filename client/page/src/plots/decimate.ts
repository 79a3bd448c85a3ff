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

/** Indices of the points to draw between `from` and `to` on `columns` columns; all where there are few. */
function visible(times: ArrayLike<number>, lines: Values[], from: number, to: number, columns: number): number[] {
  // One point beyond either end, so that lines reach the edge.
  const begin = Math.max(0, lowerBound(times, from) - 1);
  const end = Math.min(times.length, lowerBound(times, to) + 2);
  if (end - begin <= 4 * columns) return Array.from({length: Math.max(0, end - begin)}, (_, i) => begin + i);
  const shown: number[] = [];
  const width = (to - from) / columns;
  for (let start = begin; start < end; ) {
    const column = Math.floor((times[start] - from) / width);
    let stop = start + 1;
    while (stop < end && Math.floor((times[stop] - from) / width) === column) ++stop;
    const keep = new Set([start, stop - 1]);
    for (const line of lines) {
      let least = start;
      let most = start;
      for (let i = start; i < stop; ++i) {
        const value = line[i] ?? NaN;
        if (value < (line[least] ?? Infinity)) least = i;
        if (value > (line[most] ?? -Infinity)) most = i;
      }
      keep.add(least).add(most);
    }
    shown.push(...[...keep].sort((a, b) => a - b));
    start = stop;
  }
  return shown;
}

/** The times and the lines, reduced to what can be seen. */
export function decimate(
  times: ArrayLike<number>,
  lines: Values[],
  from: number,
  to: number,
  columns: number,
): [number[], ...(number | null)[][]] {
  const shown = visible(times, lines, from, to, columns);
  const take = (values: Values) =>
    shown.map((i) => {
      const value = values[i];
      return value === null || Number.isNaN(value) ? null : value;
    });
  return [shown.map((i) => times[i]), ...lines.map(take)];
}
