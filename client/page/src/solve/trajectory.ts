// SPDX-License-Identifier: Apache-2.0
// The part of a trajectory that the page holds: some components at all times, or at every few.

import type {TrajectoryChunk} from '../../generated/dlcs/v1/solver_pb';

/** States, pairs with their y and w, and outputs. */
export type Kind = 'x' | 'y' | 'w' | 'z';

/** Numbers that are appended. */
class Column {
  private data = new Float64Array(64);
  length = 0;

  push(value: number): void {
    if (this.length === this.data.length) {
      const larger = new Float64Array(2 * this.length);
      larger.set(this.data);
      this.data = larger;
    }
    this.data[this.length++] = value;
  }

  get values(): Float64Array {
    return this.data.subarray(0, this.length);
  }
}

export class Trajectory {
  private readonly t = new Column();
  private readonly columns: {[kind in Kind]: Map<number, Column>};

  /** Components from 0, in the order of the chunks. */
  constructor(
    readonly xs: number[],
    readonly ys: number[],
    readonly zs: number[],
  ) {
    const make = (components: number[]) => new Map(components.map((i) => [i, new Column()]));
    this.columns = {x: make(xs), y: make(ys), w: make(ys), z: make(zs)};
  }

  get times(): Float64Array {
    return this.t.values;
  }

  column(kind: Kind, component: number): Float64Array | null {
    const column = this.columns[kind].get(component);
    return column !== undefined && column.length === this.t.length ? column.values : null;
  }

  /** Where y, w or an output jumps there are two rows of the same time: the limits from the left and from the right. */
  add(chunk: TrajectoryChunk, stride = 1): void {
    const left = new Map(chunk.leftLimits.map((limit) => [limit.index, limit]));
    chunk.times.forEach((time, k) => {
      const x = slice(chunk.x, this.xs.length, k);
      const y = slice(chunk.y, this.ys.length, k);
      const w = slice(chunk.w, this.ys.length, k);
      const z = slice(chunk.outputs, this.zs.length, k);
      const limit = left.get(chunk.first + k * stride);
      if (limit !== undefined) {
        this.row(
          time,
          x,
          limit.y.length === this.ys.length ? limit.y : y,
          limit.w.length === this.ys.length ? limit.w : w,
          limit.outputs.length === this.zs.length ? limit.outputs : z,
        );
      }
      this.row(time, x, y, w, z);
    });
  }

  private row(time: number, x: number[], y: number[], w: number[], z: number[]): void {
    this.t.push(time);
    this.xs.forEach((component, i) => this.columns.x.get(component)!.push(x[i] ?? NaN));
    this.ys.forEach((component, i) => {
      this.columns.y.get(component)!.push(y[i] ?? NaN);
      this.columns.w.get(component)!.push(w[i] ?? NaN);
    });
    this.zs.forEach((component, i) => this.columns.z.get(component)!.push(z[i] ?? NaN));
  }
}

function slice(values: number[], size: number, k: number): number[] {
  return values.slice(k * size, (k + 1) * size);
}
