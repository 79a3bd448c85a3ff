// SPDX-License-Identifier: Apache-2.0
// The windows of time that are iterated one after the other, and those that were tried again.

import {h, replace, setText, show, table} from '../../dom';
import {count, general} from '../../format';
import type {SolveData} from '../../solve/data';
import {type Panel, section} from './panel';

const mostRows = 100;
const drawEvery = 400;

export class WindowsPanel implements Panel {
  readonly element: HTMLElement;
  private readonly notice = h('p');
  private readonly rows = h('div');
  private drawnAt = 0;
  private drawn = '';

  constructor() {
    this.element = section('Windows', this.notice, h('details', {}, h('summary', {}, 'List of windows'), this.rows));
  }

  update({model: {windows, retries, iterates, ended}}: SolveData): void {
    // Other methods report their progress as windows without iterations.
    const iterated = iterates.change.length > 0;
    show(this.element, iterated && windows.length > 0);
    const state = `${windows.length} ${windows.at(-1)?.result} ${iterates.change.length} ${retries}`;
    const now = performance.now();
    if (!iterated || state === this.drawn || (!ended && now - this.drawnAt < drawEvery)) return;
    this.drawn = state;
    this.drawnAt = now;
    const divided = `${count(retries, 'attempt')} did not converge and were divided`;
    const again = retries === 0 ? 'none of them tried again' : divided;
    const coupled = windows.filter((row) => row.result === 'coupled').length;
    setText(
      this.notice,
      `${count(windows.length - retries, 'window')}, ` +
        again +
        `${coupled === 0 ? '' : `; ${coupled} solved by a coupled step instead`}.`,
    );
    const words = {
      running: ended ? 'its end was not received' : 'running',
      accepted: 'converged',
      coupled: 'coupled step',
      retried: 'tried again',
    };
    const shown = windows.slice(-mostRows).reverse();
    replace(
      this.rows,
      table(
        ['window', 'from t', 'to t', 'steps', 'iterations', 'result'],
        shown.map((row) => [
          String(row.window),
          general(row.begin),
          general(row.end),
          row.steps || '',
          row.iterations,
          words[row.result] + (row.reason === '' ? '' : `: ${row.reason}`),
        ]),
        {class: 'windows', label: 'Windows'},
      ),
      windows.length > mostRows && h('p', {}, `The last ${mostRows} of ${windows.length} attempts are listed.`),
    );
  }
}
