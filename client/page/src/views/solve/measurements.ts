// SPDX-License-Identifier: Apache-2.0
// The numbers that the problem asks for.

import {h, replace, show, table} from '../../dom';
import {general} from '../../format';
import type {SolveData} from '../../solve/data';
import {type Panel, section} from './panel';

export class MeasurementsPanel implements Panel {
  readonly element = h('div');
  private drawn: unknown = null;

  update({model: {summary}}: SolveData): void {
    show(this.element, (summary?.measurements.length ?? 0) > 0);
    if (summary === null || summary === this.drawn) return;
    this.drawn = summary;
    replace(
      this.element,
      section(
        'Measurements',
        table(
          ['', 'value', 't'],
          summary.measurements.map(({name, value, time, reason, note}) => [
            name,
            value === undefined ? `none: ${reason}` : `${general(value, 10)}${note === '' ? '' : ` (${note})`}`,
            time === undefined ? '' : general(time, 10),
          ]),
          {label: 'Measurements'},
        ),
      ),
    );
  }
}
