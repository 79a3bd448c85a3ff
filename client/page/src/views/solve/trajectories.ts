// SPDX-License-Identifier: Apache-2.0
// Chosen outputs and components of x, y and w over time, with the switching times, the earlier iterates of y faint
// behind, and the active set below. All move together.

import type uPlot from 'uplot';
import {h, setText, show} from '../../dom';
import {BarPlot} from '../../plots/bars';
import {LinePlot, SharedRange, type Line} from '../../plots/line';
import {lineColor, plotColors} from '../../plots/theme';
import {activeSpans, type SolveData} from '../../solve/data';
import type {Kind} from '../../solve/trajectory';
import {type Panel, section} from './panel';
import {Picker} from './picker';

const mostMarks = 400;

export class TrajectoriesPanel implements Panel {
  readonly element: HTMLElement;
  private readonly range = new SharedRange();
  private readonly notice = h('p', {class: 'now'});
  private readonly outputs: Picker;
  private readonly states: Picker;
  private readonly pairs: Picker;
  private readonly plots: {[kind in Kind]: LinePlot};
  private readonly parts: {[kind in Kind]: HTMLElement};
  private readonly bars = new BarPlot('Active pairs over time', this.range);
  private readonly activePart: HTMLElement;
  private data: SolveData | null = null;
  private drawn = '';

  constructor(private readonly onChoice: () => void) {
    const changed = () => {
      this.redraw();
      this.onChoice();
    };
    this.outputs = new Picker('Outputs', changed);
    this.states = new Picker('States', changed);
    this.pairs = new Picker('Pairs', changed);
    const plot = (kind: Kind, name: string) =>
      new LinePlot({
        name,
        xLabel: 't',
        height: 210,
        range: this.range,
        behind: (drawn) => {
          this.drawSwitchings(drawn);
          if (kind === 'y') this.drawCurves(drawn);
        },
      });
    this.plots = {
      x: plot('x', 'States x over time'),
      y: plot('y', 'y over time'),
      w: plot('w', 'w over time'),
      z: plot('z', 'Outputs over time'),
    };
    const part = (kind: Kind, title: string) => h('div', {}, h('h3', {}, title), this.plots[kind].element);
    this.parts = {x: part('x', 'States x'), y: part('y', 'y'), w: part('w', 'w'), z: part('z', 'Outputs')};
    this.activePart = h(
      'div',
      {},
      h('h3', {}, 'Active set'),
      h('p', {class: 'note'}, 'A bar where y may be positive, and w is 0.'),
      this.bars.element,
    );
    const button = (text: string, label: string, act: () => void) =>
      h('button', {type: 'button', 'aria-label': label, on: {click: act}}, text);
    const zoom = (key: string) => () => this.plots.x.element.dispatchEvent(new KeyboardEvent('keydown', {key}));
    this.element = section(
      'Trajectories',
      h(
        'div',
        {class: 'tools'},
        this.outputs.element,
        this.states.element,
        this.pairs.element,
        h(
          'div',
          {class: 'zoom'},
          button('−', 'Zoom out', zoom('-')),
          button('+', 'Zoom in', zoom('+')),
          button('←', 'Earlier', zoom('ArrowLeft')),
          button('→', 'Later', zoom('ArrowRight')),
          button('All', 'Show all', zoom('0')),
        ),
      ),
      this.notice,
      this.parts.z,
      this.parts.x,
      this.parts.y,
      this.parts.w,
      this.activePart,
    );
  }

  /** The components that the plots need. */
  get chosen(): {states: number[]; pairs: number[]; outputs: number[]} {
    return {states: this.states.chosen, pairs: this.pairs.chosen, outputs: this.outputs.chosen};
  }

  destroy(): void {
    Object.values(this.plots).forEach((plot) => plot.destroy());
    this.bars.destroy();
  }

  update(data: SolveData): void {
    const fresh = data.trajectory !== this.data?.trajectory;
    this.data = data;
    const {names} = data.model;
    this.outputs.set(data.outputs, (i) => names.z(i));
    show(this.outputs.element, data.outputs > 0);
    this.states.set(data.states, (i) => names.x(i));
    this.pairs.set(data.pairs, (i) => names.y(i));
    const {
      model: {curves, summary},
      trajectory,
    } = data;
    const state =
      `${trajectory?.times.length} ${curves.length} ${curves.at(-1)?.window} ${curves.at(-1)?.iteration} ` +
      `${summary !== null}`;
    if (state === this.drawn && !fresh) return;
    this.drawn = state;
    this.redraw();
  }

  private redraw(): void {
    const {data} = this;
    if (data === null) return;
    const {trajectory, model, horizon} = data;
    const length = trajectory?.times.length ?? 0;
    const running = model.curves.length > 0 && (length === 0 || !model.ended);
    show(this.element, length > 0 || running || !model.ended);
    setText(this.notice, length > 0 || running ? '' : 'The solution appears here as soon as its first part is known.');
    show(this.notice, this.notice.textContent !== '');
    const {states, pairs, outputs} = this.chosen;
    const lines = (kind: Kind, components: number[]): Line[] =>
      components.flatMap((i, k) => {
        const values = trajectory?.column(kind, i);
        return values ? [{label: model.names[kind](i), color: () => lineColor(k), values}] : [];
      });
    // While it runs the axis already has its full length.
    const times = trajectory?.times ?? new Float64Array();
    const draw = (kind: Kind, components: number[]) => {
      const drawnLines = lines(kind, components);
      const faint = kind === 'y' && running;
      show(this.parts[kind], (length > 0 && drawnLines.length > 0) || faint);
      if (length > 0 && !faint) {
        this.plots[kind].set(times, drawnLines);
      } else if (faint) {
        this.plots.y.set(...this.curveLines(pairs, horizon));
      }
    };
    draw('z', outputs);
    draw('x', states);
    draw('y', pairs);
    draw('w', pairs);
    show(this.activePart, length > 0 && pairs.length > 0);
    const spans = activeSpans(data, pairs);
    this.bars.set(
      pairs.map((pair, k) => ({name: model.names.y(pair), spans: spans[k]})),
      times.at(-1) ?? horizon,
    );
  }

  // The newest iterate of each window as lines.
  private curveLines(pairs: number[], horizon: number): [number[], Line[]] {
    const newest = new Map(this.data!.model.curves.map((curve) => [curve.window, curve]));
    const times = [0];
    const values = pairs.map((): (number | null)[] => [null]);
    for (const curve of newest.values()) {
      curve.times.forEach((time, k) => {
        if (time <= times[times.length - 1] && times.length > 1) return;
        times.push(time);
        pairs.forEach((pair, i) => {
          const place = curve.components.indexOf(pair);
          values[i].push(place < 0 ? null : curve.y[k * curve.components.length + place]);
        });
      });
    }
    times.push(horizon);
    values.forEach((column) => column.push(null));
    const {names} = this.data!.model;
    return [times, pairs.map((pair, i) => ({label: names.y(pair), color: () => lineColor(i), values: values[i]}))];
  }

  private drawSwitchings({ctx, bbox, valToPos}: uPlot): void {
    const switchings = this.data?.model.summary?.switchingTimes ?? [];
    ctx.save();
    ctx.strokeStyle = plotColors().marker;
    ctx.setLineDash([3, 4]);
    // Of the pairs that are shown, and what is of no pair, such as a break point.
    const {pairs} = this.chosen;
    const isShown = (pair: number) => pairs.includes(pair);
    let drawn = 0;
    for (const {time, entering, leaving} of switchings) {
      const of = [...entering, ...leaving];
      if (pairs.length > 0 && of.length > 0 && !of.some(isShown)) continue;
      const x = Math.round(valToPos(time, 'x', true));
      if (x <= bbox.left || x > bbox.left + bbox.width) continue;
      if (++drawn > mostMarks) break;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  private drawCurves({ctx, bbox, valToPos}: uPlot): void {
    const curves = this.data?.model.curves ?? [];
    const {pairs} = this.chosen;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const {times, y, components} of curves) {
      pairs.forEach((pair, k) => {
        const place = components.indexOf(pair);
        if (place < 0) return;
        ctx.strokeStyle = lineColor(k);
        ctx.globalAlpha = 0.25;
        ctx.beginPath();
        times.forEach((time, at) =>
          ctx.lineTo(valToPos(time, 'x', true), valToPos(y[at * components.length + place], 'y', true)),
        );
        ctx.stroke();
      });
    }
    ctx.restore();
  }
}
