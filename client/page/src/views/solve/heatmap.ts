// SPDX-License-Identifier: Apache-2.0
// Many components at once as colors: over time or, where the states are the points of a grid, in space at one time.

import {h, oncePerFrame, setText, show} from '../../dom';
import {count, general} from '../../format';
import {extent, type Grid, HeatMap} from '../../plots/heat';
import type {SolveData} from '../../solve/data';
import type {Kind, Trajectory} from '../../solve/trajectory';
import {type Panel, section} from './panel';

const fewest = 8;
// Up to this many numbers, all components are loaded without asking the user.
const few = 2e6;

export class HeatMapPanel implements Panel {
  readonly element: HTMLElement;
  private readonly map = new HeatMap('Heat map');
  private readonly quantity: HTMLSelectElement;
  private readonly layout: HTMLSelectElement;
  private readonly rows: HTMLInputElement;
  private readonly rowsField: HTMLElement;
  private readonly time: HTMLInputElement;
  private readonly timeField: HTMLElement;
  private readonly timeText = h('output', {for: 'heat-time'});
  private readonly load = h('button', {type: 'button'}, 'Load all components');
  private readonly tools: HTMLElement;
  private field: Trajectory | null = null;
  private bounds: {of: string; range: [number, number]} | null = null;
  private data: SolveData | null = null;
  private drawn = '';
  private readonly redraw = oncePerFrame(() => this.draw());

  /** `loadField` reads all components of a job whose plots hold only some; null if there is no job. */
  constructor(private readonly loadField: (() => Promise<Trajectory>) | null) {
    const select = (id: string, options: [string, string][]) =>
      h(
        'select',
        {id},
        options.map(([value, text]) => h('option', {value}, text)),
      );
    this.quantity = select('heat-kind', [
      ['x', 'x'],
      ['y', 'y'],
      ['w', 'w'],
    ]);
    this.layout = select('heat-layout', [
      ['time', 'over time'],
      ['space', 'in space, at one time'],
    ]);
    this.rows = h('input', {id: 'heat-rows', type: 'number', min: 1, class: 'short'});
    this.time = h('input', {id: 'heat-time', type: 'range', min: 0, max: 1000, value: 1000});
    this.rowsField = h('span', {}, h('label', {for: 'heat-rows'}, 'Rows of the grid'), this.rows);
    this.timeField = h('span', {}, h('label', {for: 'heat-time'}, 'Time'), this.time, this.timeText);
    this.tools = h(
      'div',
      {class: 'tools'},
      h('span', {}, h('label', {for: 'heat-kind'}, 'Show'), this.quantity),
      h('span', {}, h('label', {for: 'heat-layout'}, 'Layout'), this.layout),
      this.rowsField,
      this.timeField,
    );
    for (const control of [this.quantity, this.layout, this.rows, this.time]) {
      control.addEventListener('input', this.redraw);
    }
    this.load.addEventListener('click', () => void this.onLoad());
    this.element = section('Heat map', this.tools, this.load, this.map.element);
  }

  update(data: SolveData): void {
    const first = this.data === null;
    this.data = data;
    const {states, pairs, grid, trajectory} = data;
    show(this.element, Math.max(states, pairs) >= fewest && (trajectory?.times.length ?? 0) > 1);
    if (this.element.hidden) return;
    if (first || this.rows.value === '') {
      this.rows.value = String(grid[0] ?? likelyRows(states));
      if (grid.length > 1) this.layout.value = 'space';
    }
    const state = `${trajectory!.times.length}`;
    if (state === this.drawn) return;
    this.drawn = state;
    this.redraw();
    const {summary} = data.model;
    const small = summary !== null && summary.times * (states + 2 * pairs) <= few;
    if (small && trajectory!.column('x', states - 1) === null && this.field === null) void this.onLoad();
  }

  private async onLoad(): Promise<void> {
    if (this.loadField === null || this.load.disabled) return;
    this.load.disabled = true;
    setText(this.load, 'Loading …');
    try {
      this.field = await this.loadField();
    } finally {
      this.load.disabled = false;
      setText(this.load, 'Load all components');
    }
    this.redraw();
  }

  private draw(): void {
    const {data} = this;
    if (data === null) return;
    const kind = this.quantity.value as Kind;
    const size = kind === 'x' ? data.states : data.pairs;
    const source = [data.trajectory, this.field].find((held) => held?.column(kind, size - 1) && held.column(kind, 0));
    const whole = source && [...Array(size).keys()].every((i) => source.column(kind, i) !== null);
    show(this.load, !whole && this.loadField !== null);
    show(this.map.element, whole === true);
    const space = kind === 'x' && this.layout.value === 'space';
    show(this.rowsField, space);
    show(this.timeField, space);
    if (!source || !whole) return;
    const {times} = source;
    const columns = Array.from({length: size}, (_, i) => source.column(kind, i)!);
    const overTime: Grid = {rows: size, columns: times.length, at: timesOf(times, columns)};
    if (!space) {
      this.map.set(
        overTime,
        `t from ${general(times[0])} to ${general(times[times.length - 1])}`,
        `${kind}1 at the top to ${kind}${size}`,
        false,
      );
      return;
    }
    const rows = Math.min(Math.max(1, Math.floor(Number(this.rows.value)) || 1), size);
    const across = Math.floor(size / rows);
    const at = Math.round((Number(this.time.value) / 1000) * (times.length - 1));
    setText(this.timeText, `t = ${general(times[at], 4)}`);
    // The colors mean the same at all times.
    const of = `${times.length} ${size}`;
    if (this.bounds?.of !== of) this.bounds = {of, range: extent(overTime)};
    this.map.set(
      {rows, columns: across, at: (row, column) => columns[row * across + column][at]},
      `${count(across, 'column')}`,
      `${count(rows, 'row')}`,
      true,
      this.bounds.range,
    );
  }
}

// Columns of pixels are equal parts of time, whatever the steps are.
function timesOf(times: Float64Array, columns: Float64Array[]): Grid['at'] {
  const nearest = new Int32Array(times.length);
  const [first, last] = [times[0], times[times.length - 1]];
  for (let j = 0, k = 0; j < times.length; ++j) {
    const wanted = first + ((last - first) * j) / Math.max(1, times.length - 1);
    while (k + 1 < times.length && times[k + 1] <= wanted) ++k;
    nearest[j] = k;
  }
  return (row, column) => columns[row][nearest[column]];
}

function likelyRows(states: number): number {
  const root = Math.round(Math.sqrt(states));
  return root * root === states ? root : 1;
}
