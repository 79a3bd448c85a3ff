// SPDX-License-Identifier: Apache-2.0
// A heat map: a rectangle of values as colors, with its scale.

import {h, setText} from '../dom';
import {general} from '../format';
import {mapColor} from './theme';

export interface Grid {
  rows: number;
  columns: number;
  at: (row: number, column: number) => number;
}

const tallest = 420;

export class HeatMap {
  readonly element: HTMLElement;
  private readonly canvas: HTMLCanvasElement;
  private readonly map: HTMLElement;
  private readonly least = h('span');
  private readonly most = h('span');
  private readonly across = h('span');
  private readonly down = h('span', {class: 'down'});

  constructor(name: string) {
    this.canvas = h('canvas', {role: 'img', 'aria-label': name});
    this.map = h('div', {class: 'map'}, this.down, this.canvas, this.across);
    this.element = h(
      'div',
      {class: 'heat'},
      this.map,
      h('div', {class: 'scale'}, this.least, h('span', {class: 'ramp', 'aria-hidden': 'true'}), this.most),
    );
  }

  /** The colors span `bounds`, otherwise the values of the grid. In space all cells are squares. */
  set(grid: Grid, across: string, down: string, inSpace: boolean, bounds?: [number, number]): void {
    const {rows, columns} = grid;
    if (rows === 0 || columns === 0) return;
    // No more pixels than a screen has: of more cells one in each pixel is shown.
    const width = Math.min(columns, 1200);
    const height = Math.min(rows, 800);
    const [least, most] = bounds ?? extent(grid);
    const image = new ImageData(width, height);
    for (let i = 0; i < height; ++i) {
      const row = Math.floor((i * rows) / height);
      for (let j = 0; j < width; ++j) {
        const value = grid.at(row, Math.floor((j * columns) / width));
        const at = 4 * (i * width + j);
        if (Number.isNaN(value)) continue;
        image.data.set(mapColor(most > least ? (value - least) / (most - least) : 0.5), at);
        image.data[at + 3] = 255;
      }
    }
    Object.assign(this.canvas, {width, height});
    Object.assign(
      this.canvas.style,
      inSpace ? {height: 'auto', aspectRatio: `${columns} / ${rows}`} : {height: '', aspectRatio: ''},
    );
    this.map.style.flex = inSpace ? `0 1 ${Math.round((tallest * columns) / rows)}px` : '';
    this.canvas.getContext('2d')!.putImageData(image, 0, 0);
    setText(this.least, general(least, 4));
    setText(this.most, general(most, 4));
    setText(this.across, across);
    setText(this.down, down);
  }
}

export function extent({rows, columns, at}: Grid): [number, number] {
  let least = Infinity;
  let most = -Infinity;
  for (let i = 0; i < rows; ++i) {
    for (let j = 0; j < columns; ++j) {
      const value = at(i, j);
      if (value < least) least = value;
      if (value > most) most = value;
    }
  }
  return least <= most ? [least, most] : [0, 1];
}
