// SPDX-License-Identifier: Apache-2.0
// Which pairs are active when: a row for each pair, a bar where y may be positive (w = 0).

import {h} from '../dom';
import {leftAxis, rightMargin, type SharedRange} from './line';
import {lineColor, onThemeChange, plotColors} from './theme';

export interface Span {
  from: number;
  to: number;
}

const tallest = 480;

export class BarPlot {
  readonly element: HTMLElement;
  private readonly canvas = h('canvas');
  private rows: {name: string; spans: Span[]}[] = [];
  private end = 1;
  private readonly ended = new AbortController();
  private readonly resized = new ResizeObserver(() => this.draw());

  constructor(
    name: string,
    private readonly range: SharedRange,
  ) {
    this.element = h('div', {class: 'bars', role: 'img', 'aria-label': name}, this.canvas);
    const forget = range.onChange(() => this.draw());
    this.ended.signal.addEventListener('abort', forget);
    onThemeChange(() => this.draw(), this.ended.signal);
    this.resized.observe(this.element);
  }

  destroy(): void {
    this.ended.abort();
    this.resized.disconnect();
  }

  set(rows: {name: string; spans: Span[]}[], end: number): void {
    this.rows = rows;
    this.end = end;
    this.draw();
  }

  private draw(): void {
    const width = this.element.clientWidth;
    if (width === 0 || this.rows.length === 0) return;
    const row = Math.max(2, Math.min(22, Math.floor(tallest / this.rows.length)));
    const height = row * this.rows.length + 4;
    const scale = devicePixelRatio;
    Object.assign(this.canvas, {width: width * scale, height: height * scale});
    Object.assign(this.canvas.style, {width: `${width}px`, height: `${height}px`});
    const context = this.canvas.getContext('2d')!;
    context.scale(scale, scale);
    const [from, to] = this.range.shown ?? [0, this.end];
    const inner = width - leftAxis - rightMargin;
    const {text, grid} = plotColors();
    context.font = '12px system-ui, sans-serif';
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    this.rows.forEach(({name, spans}, i) => {
      const top = 2 + i * row;
      if (row >= 12) {
        context.fillStyle = text;
        context.fillText(name, leftAxis - 8, top + row / 2, leftAxis - 10);
        context.fillStyle = grid;
        context.fillRect(leftAxis, top + row / 2 - 0.5, inner, 1);
      }
      context.fillStyle = lineColor(i);
      for (const span of spans) {
        if (span.to < from || span.from > to) continue;
        const left = Math.max(0, (span.from - from) / (to - from)) * inner;
        const right = Math.min(1, (span.to - from) / (to - from)) * inner;
        context.fillRect(leftAxis + left, top + (row > 6 ? 3 : 0), Math.max(1, right - left), row > 6 ? row - 6 : row);
      }
    });
  }
}
