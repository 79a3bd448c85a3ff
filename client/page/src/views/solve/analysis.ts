// SPDX-License-Identifier: Apache-2.0
// What is known about the problem before it is solved.

import {h, replace, show} from '../../dom';
import {count, general} from '../../format';
import {methodWord} from '../../names';
import type {SolveData} from '../../solve/data';
import {facts, type Panel, section} from './panel';

export class AnalysisPanel implements Panel {
  readonly element: HTMLElement;
  private readonly body = h('div');
  private drawn: unknown[] = [];

  constructor() {
    this.element = section('Analysis', this.body);
  }

  update({model: {analysis}, horizon}: SolveData): void {
    show(this.element, analysis !== null);
    if (analysis === null || (analysis === this.drawn[0] && horizon === this.drawn[1])) return;
    this.drawn = [analysis, horizon];
    const {states, constraints, matrixClass, method, reason, steps, step, lipschitz, warnings} = analysis;
    replace(
      this.body,
      facts([
        [
          'Size',
          `${count(states, 'state')}, ${count(constraints, 'pair')}${horizon > 0 ? `, T = ${general(horizon)}` : ''}`,
        ],
        ['Class of M', matrixClass],
        ['Method', methodWord(method)],
        ['Why', reason],
        [
          'Steps',
          steps === 0 ? 'chosen for the allowed error' : `${count(steps, 'step')} of at most ${general(step, 4)}`,
        ],
        ['Lipschitz constant', lipschitz ? general(lipschitz, 3) : ''],
      ]),
      warnings.length > 0 &&
        h(
          'ul',
          {class: 'warnings'},
          warnings.map((text) => h('li', {}, `Warning: ${text}`)),
        ),
    );
  }
}
