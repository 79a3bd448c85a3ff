// SPDX-License-Identifier: Apache-2.0
// Lines over time or over iterations: uPlot, with what it lacks: zoom by wheel and by keys, moving by drag, ranges that
// several plots share, and decimation.

import uPlot from 'uplot';
import {h} from '../dom';
import {general, short} from '../format';
import {decimate, type Values} from './decimate';
import {onThemeChange, plotColors} from './theme';

export interface Line {
  label: string;
  color: () => string;
  values: Values;
  dash?: number[];
  width?: number;
}

export interface LineOptions {
  /** What the plot shows, for those who cannot see it. */
  name: string;
  xLabel: string;
  height: number;
  /** A logarithmic axis, and the part of it that is shown. */
  log?: () => [number, number];
  /** The horizontal axis counts. */
  whole?: boolean;
  /** Draws behind the lines. */
  behind?: (plot: uPlot) => void;
  /** For several plots that are moved together. */
  range?: SharedRange;
}

/** The part of the horizontal axis that is shown; null for all of it. */
export class SharedRange {
  shown: [number, number] | null = null;
  private readonly listeners = new Set<() => void>();

  set(shown: [number, number] | null): void {
    this.shown = shown;
    for (const listener of this.listeners) listener();
  }

  onChange(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}

// Up to this many points are also drawn individually.
const fewPoints = 40;
export const leftAxis = 64;
export const rightMargin = 24; // half of a long label

export class LinePlot {
  readonly element: HTMLElement;
  readonly range: SharedRange;
  private plot: uPlot | null = null;
  private times: ArrayLike<number> = [];
  private lines: Line[] = [];
  private shape = '';
  private readonly ended = new AbortController();
  private readonly resized = new ResizeObserver(() => this.resize());

  constructor(private readonly options: LineOptions) {
    this.range = options.range ?? new SharedRange();
    this.element = h('div', {
      class: 'plot',
      tabindex: 0,
      role: 'img',
      'aria-label': `${options.name}. Keys: arrows move, plus and minus zoom, 0 shows all.`,
    });
    const forget = this.range.onChange(() => this.draw());
    this.ended.signal.addEventListener('abort', forget);
    this.element.addEventListener('keydown', (event) => this.onKey(event));
    onThemeChange(() => this.rebuild(), this.ended.signal);
    this.resized.observe(this.element);
  }

  destroy(): void {
    this.ended.abort();
    this.resized.disconnect();
    this.plot?.destroy();
  }

  set(times: ArrayLike<number>, lines: Line[]): void {
    this.times = times;
    this.lines = lines;
    const shape = JSON.stringify(lines.map(({label, dash, width}) => [label, dash, width]));
    if (shape !== this.shape || this.plot === null) {
      this.shape = shape;
      this.rebuild();
    } else {
      this.draw();
    }
  }

  /** All of the horizontal axis. */
  private get extent(): [number, number] {
    const count = this.times.length;
    if (count === 0) return [0, 1];
    const [first, last] = [this.times[0], this.times[count - 1]];
    return last > first ? [first, last] : [first - 0.5, first + 0.5];
  }

  private get shown(): [number, number] {
    return this.range.shown ?? this.extent;
  }

  private draw(): void {
    if (this.plot === null) return;
    const [from, to] = this.shown;
    const data = decimate(
      this.times,
      this.lines.map((line) => line.values),
      from,
      to,
      Math.max(100, this.width),
    );
    this.plot.batch(() => {
      this.plot!.setData(data as uPlot.AlignedData, false);
      this.plot!.setScale('x', {min: from, max: to});
    });
  }

  private get width(): number {
    return this.element.clientWidth;
  }

  private resize(): void {
    if (this.width === 0) return;
    if (this.plot === null) {
      this.rebuild();
    } else if (this.plot.width !== this.width) {
      this.plot.setSize({width: this.width, height: this.options.height});
      this.draw();
    }
  }

  private rebuild(): void {
    this.plot?.destroy();
    this.plot = null;
    if (this.width === 0) return;
    const {text, grid} = plotColors();
    const font = '12px system-ui, sans-serif';
    const axis = {stroke: text, font, grid: {stroke: grid, width: 1}, ticks: {stroke: grid, width: 1}};
    this.plot = new uPlot(
      {
        width: this.width,
        height: this.options.height,
        padding: [10, rightMargin, 0, 0],
        legend: {live: true},
        cursor: {
          drag: {x: false, y: false},
          points: {size: 6},
          dataIdx: (plot, line, at) => nearestPoint(plot.data[line], at),
        },
        scales: {
          x: {time: false, auto: false},
          y: this.options.log ? {distr: 3, range: this.options.log} : {range: (_, least, most) => around(least, most)},
        },
        axes: [
          {
            ...axis,
            label: this.options.xLabel,
            labelSize: 18,
            labelFont: font,
            size: 34,
            incrs: this.options.whole ? wholeSteps : undefined,
            space: (_, __, least, most) => roomOfTicks(least, most),
            values: (_, splits) => splits.map((value) => short(value)),
          },
          {
            ...axis,
            size: leftAxis,
            splits: this.options.log ? (_, __, least, most) => decades(least, most) : undefined,
            filter: this.options.log ? (_, splits) => splits : undefined,
            values: (_, splits) =>
              this.options.log ? splits.map((value) => (value === null ? '' : power(value))) : labelsOf(splits),
          },
        ],
        series: [
          {label: this.options.xLabel, value: (_, value) => (value === null ? '' : general(value, 6))},
          ...this.lines.map(
            (line): uPlot.Series => ({
              label: line.label,
              stroke: line.color(),
              width: line.width ?? 1.75,
              dash: line.dash,
              // Between pixels too: rounded to them, a slowly rising line is a staircase.
              pxAlign: 0,
              points: {show: () => this.times.length < fewPoints, size: 5},
              spanGaps: false,
              value: (_, value) => (value === null || value === undefined ? '' : general(value, 6)),
            }),
          ),
        ],
        hooks: {drawClear: this.options.behind ? [this.options.behind] : []},
      },
      [[], ...this.lines.map(() => [])] as unknown as uPlot.AlignedData,
      this.element,
    );
    this.listen(this.plot.over);
    this.draw();
  }

  private listen(over: HTMLElement): void {
    over.addEventListener(
      'wheel',
      (event) => {
        // The page scrolls as everywhere; only a pinch or a wheel with Ctrl, or over a plot that has the focus, zooms.
        if (!event.ctrlKey && !this.element.contains(document.activeElement)) return;
        event.preventDefault();
        const place = event.offsetX / over.clientWidth;
        this.zoom(Math.exp(event.deltaY * 0.002), place);
      },
      {passive: false},
    );
    over.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      const {shown} = this;
      const start = event.clientX;
      over.setPointerCapture(event.pointerId);
      const move = (moved: PointerEvent) => {
        const by = ((start - moved.clientX) / over.clientWidth) * (shown[1] - shown[0]);
        if (Math.abs(start - moved.clientX) > 2) this.show(shown[0] + by, shown[1] + by);
      };
      over.addEventListener('pointermove', move);
      over.addEventListener('pointerup', () => over.removeEventListener('pointermove', move), {once: true});
      over.addEventListener('pointercancel', () => over.removeEventListener('pointermove', move), {once: true});
    });
    over.addEventListener('dblclick', () => this.range.set(null));
  }

  private onKey(event: KeyboardEvent): void {
    const [from, to] = this.shown;
    const step = (to - from) / 8;
    switch (event.key) {
      case 'ArrowLeft':
        this.show(from - step, to - step);
        break;
      case 'ArrowRight':
        this.show(from + step, to + step);
        break;
      case '+':
      case '=':
        this.zoom(0.7, 0.5);
        break;
      case '-':
        this.zoom(1 / 0.7, 0.5);
        break;
      case '0':
        this.range.set(null);
        break;
      default:
        return;
    }
    event.preventDefault();
  }

  private zoom(factor: number, place: number): void {
    const [from, to] = this.shown;
    const at = from + place * (to - from);
    this.show(at - (at - from) * factor, at + (to - at) * factor);
  }

  private show(from: number, to: number): void {
    const [first, last] = this.extent;
    const length = to - from;
    if (length >= last - first) {
      this.range.set(null);
    } else if (length > 1e-9 * (last - first)) {
      const begin = Math.min(Math.max(from, first), last - length);
      this.range.set([begin, begin + length]);
    }
  }
}

const wholeSteps = [1, 2, 5]
  .flatMap((digit) => [0, 1, 2, 3, 4, 5, 6].map((power) => digit * 10 ** power))
  .sort((a, b) => a - b);

// The vertical axis for values from `least` to `most`; null if there are none.
function around(least: number | null, most: number | null): [number, number] {
  if (least === null || most === null || (least === 0 && most === 0)) return [0, 1];
  return uPlot.rangeNum(least, most, 0.1, true) as [number, number];
}

// The labels of the vertical axis, with enough digits to distinguish them. If those have no room, all but the lowest
// show the difference to it.
function labelsOf(splits: number[]): string[] {
  for (const digits of [4, 5, 6]) {
    const labels = splits.map((value) => short(value, digits));
    if (new Set(labels).size === labels.length) return labels;
  }
  return splits.map((value, k) => (k === 0 ? short(value, 7) : `+${short(value - splits[0], 3)}`));
}

// The pixels from one label of the horizontal axis to the next, so that the longest of them fits.
function roomOfTicks(least: number, most: number): number {
  const largest = Math.max(Math.abs(least), Math.abs(most));
  const digits = Math.ceil(Math.log10(largest / (most - least))) + 3;
  const pi = short(largest * 0.314159265358979, Math.min(Math.max(digits, 2), 8));
  return Math.max(50, 8 * (pi.length + 2));
}

// The index of a point that the line has, next to `at`.
function nearestPoint(values: ArrayLike<number | null | undefined>, at: number): number {
  for (let by = 0; by < values.length; ++by) {
    if (values[at - by] !== undefined) return at - by;
    if (values[at + by] !== undefined) return at + by;
  }
  return at;
}

function power(value: number): string {
  const exponent = Math.round(Math.log10(value));
  return Math.abs(exponent) <= 2 ? String(Number(value.toPrecision(2))) : `1e${exponent}`;
}

// Powers of ten, not more than there is room for.
function decades(least: number, most: number): number[] {
  const low = Math.ceil(Math.log10(least) - 1e-9);
  const high = Math.floor(Math.log10(most) + 1e-9);
  const step = Math.max(1, Math.ceil((high - low) / 8));
  return Array.from({length: Math.floor((high - low) / step) + 1}, (_, i) => 10 ** (low + i * step));
}
