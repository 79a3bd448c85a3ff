// SPDX-License-Identifier: Apache-2.0
// How the solve ended: the words of the command line, with what to be aware of.

import {Termination, VerdictKind} from '../../../generated/dlcs/v1/solver_pb';
import {h, replace, show} from '../../dom';
import {methodWord, verdictText} from '../../names';
import type {SolveData} from '../../solve/data';
import type {Panel} from './panel';

export class VerdictPanel implements Panel {
  readonly element = h('section', {class: 'card verdict', 'aria-live': 'polite', hidden: true});
  private drawn: unknown = null;

  update({model: {summary}}: SolveData): void {
    show(this.element, summary !== null);
    if (summary === null || summary === this.drawn) return;
    this.drawn = summary;
    const {verdict, termination, message, method, reason} = summary;
    const stopped = termination === Termination.CANCELLED || termination === Termination.DEADLINE;
    const kind = verdict?.success
      ? verdict.concerns.length > 0
        ? 'fair'
        : verdict.kind === VerdictKind.SOLVED
          ? 'good'
          : 'plain'
      : stopped
        ? 'fair'
        : 'bad';
    this.element.dataset.kind = kind;
    const refused = termination === Termination.UNSUPPORTED && summary.cost?.lcps === 0n;
    const warnings = [...(verdict?.concerns ?? []), ...summary.warnings];
    replace(
      this.element,
      h('h2', {}, verdictText(summary)),
      message !== '' && h('p', {}, message),
      !refused && h('p', {}, `Method ${methodWord(method)}${reason === '' ? '' : `: ${reason}`}`),
      (verdict?.notes ?? []).map((text) => h('p', {class: 'note'}, text)),
      warnings.length > 0 &&
        h(
          'ul',
          {class: 'warnings'},
          warnings.map((text) => h('li', {}, `Warning: ${text}`)),
        ),
    );
  }
}
