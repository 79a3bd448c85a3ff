// SPDX-License-Identifier: Apache-2.0
// The change of each iteration on a logarithmic axis, with the bound that theory gives before the solve.

import {Method} from '../../../generated/dlcs/v1/solver_pb';
import {h, setText, show} from '../../dom';
import {count, size} from '../../format';
import {LinePlot} from '../../plots/line';
import {lineColor, plotColors} from '../../plots/theme';
import type {SolveData} from '../../solve/data';
import {type Panel, section} from './panel';

const mostMarks = 80;
// On long windows the bound grows astronomically before it falls. More than this many decades above the changes it
// leaves the plot at the top, unless the user wants all of it.
const farAbove = 3;

export class ConvergencePanel implements Panel {
  readonly element: HTMLElement;
  private readonly now = h('p', {class: 'now'});
  private readonly lastOnly = h('input', {type: 'checkbox', id: 'last-window'});
  private readonly wholeBound = h('input', {type: 'checkbox', id: 'whole-bound'});
  private readonly plot: LinePlot;
  private readonly tools: HTMLElement;
  private marks: number[] = [];
  private decades: [number, number] = [-12, 0];
  private drawn = -1;
  private last: SolveData | null = null;

  constructor() {
    this.plot = new LinePlot({
      name: 'Change of each iteration, its theoretical bound and the residual, on a logarithmic axis',
      xLabel: 'iteration',
      height: 280,
      whole: true,
      log: () => [10 ** this.decades[0], 10 ** this.decades[1]],
      behind: (plot) => {
        const {ctx, bbox} = plot;
        ctx.save();
        ctx.strokeStyle = plotColors().marker;
        ctx.globalAlpha = 0.5;
        ctx.setLineDash([3, 3]);
        for (const mark of this.marks) {
          const x = Math.round(plot.valToPos(mark - 0.5, 'x', true));
          if (x < bbox.left || x > bbox.left + bbox.width) continue;
          ctx.beginPath();
          ctx.moveTo(x, bbox.top);
          ctx.lineTo(x, bbox.top + bbox.height);
          ctx.stroke();
        }
        ctx.restore();
      },
    });
    for (const box of [this.lastOnly, this.wholeBound]) {
      box.addEventListener('change', () => {
        this.drawn = -1;
        this.plot.range.set(null);
        if (this.last !== null) this.update(this.last);
      });
    }
    this.tools = h(
      'div',
      {class: 'tools'},
      h('label', {class: 'check', for: 'last-window'}, this.lastOnly, 'Only the last window'),
      h('label', {class: 'check', for: 'whole-bound'}, this.wholeBound, 'All of the bound'),
    );
    this.element = section('Convergence', this.now, this.plot.element, this.tools);
  }

  destroy(): void {
    this.plot.destroy();
  }

  update(data: SolveData): void {
    this.last = data;
    const {model} = data;
    const {iterates, lastIterate} = model;
    const length = iterates.change.length;
    const method = model.summary?.method ?? model.analysis?.method;
    const mayIterate =
      method === undefined || method === Method.LAPLACE_ITERATION || method === Method.WU_CHEN_ITERATION;
    // Within a tolerance the same is solved with several grids, and their iterations are not reported.
    const silent = model.analysis?.steps === 0;
    const lost = model.ended && (model.missed || silent);
    show(this.element, length > 0 || (mayIterate && (!model.ended || lost)));
    show(this.plot.element, length > 0);
    show(this.tools, length > 0);
    if (length === 0 || lastIterate === null) {
      this.drawn = 0;
      setText(
        this.now,
        silent
          ? 'A solve within a tolerance reports no iterations. Give a number of steps to see them.'
          : lost
            ? 'The server no longer holds the iterations of this solve.'
            : 'No iteration has ended yet.',
      );
      return;
    }
    if (length === this.drawn) return;
    this.drawn = length;
    const bound = iterates.bound[length - 1];
    setText(
      this.now,
      `Window ${lastIterate.window}, iteration ${lastIterate.iteration}: ` +
        `change ${size(iterates.change[length - 1])}` +
        `${bound === null ? '' : `, at most 10^${bound.toFixed(1)} by theory`}, ` +
        `LCP residual ${size(iterates.residual[length - 1])}. ${count(length, 'iteration')} in all` +
        `${model.missed ? ', some of which the server did not send' : ''}.`,
    );
    this.draw(data);
  }

  private draw({model: {iterates}}: SolveData): void {
    const length = iterates.change.length;
    const from = this.lastOnly.checked ? iterates.window.indexOf(iterates.window[length - 1]) : 0;
    const numbers = Array.from({length: length - from}, (_, k) => k + 1);
    // A window that begins, or begins again.
    const iteration = iterates.iteration.slice(from);
    this.marks = numbers.filter((_, k) => k > 0 && iteration[k] <= iteration[k - 1]);
    if (this.marks.length > mostMarks) this.marks = [];
    const change = iterates.change.slice(from);
    const residual = iterates.residual.slice(from);
    const bound = iterates.bound.slice(from).map((log) => (log === null || Math.abs(log) > 300 ? null : log));
    this.decades = this.range(change, residual, bound);
    const positive = (values: number[]) => values.map((value) => (value > 0 ? value : null));
    this.plot.set(numbers, [
      {label: 'change', color: () => lineColor(0), values: positive(change), width: 2},
      {
        label: 'bound by theory',
        color: () => lineColor(1),
        dash: [8, 5],
        values: bound.map((log) => (log === null ? null : 10 ** log)),
      },
      {label: 'LCP residual', color: () => lineColor(2), values: positive(residual), dash: [2, 4]},
    ]);
  }

  // The decades to show.
  private range(change: number[], residual: number[], bound: (number | null)[]): [number, number] {
    let low = Infinity;
    let high = -Infinity;
    for (const value of [...change, ...residual]) {
      if (!(value > 0) || !Number.isFinite(value)) continue;
      low = Math.min(low, Math.log10(value));
      high = Math.max(high, Math.log10(value));
    }
    if (low > high) [low, high] = [-12, 0];
    const most = this.wholeBound.checked ? 300 : high + farAbove;
    const least = this.wholeBound.checked ? -300 : low - farAbove;
    for (const log of bound) {
      if (log === null) continue;
      low = Math.min(low, Math.max(log, least));
      high = Math.max(high, Math.min(log, most));
    }
    return [Math.floor(low), Math.max(Math.ceil(high), Math.floor(low) + 1)];
  }
}
