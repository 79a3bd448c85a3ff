// SPDX-License-Identifier: Apache-2.0
// A part of the page of a solve: it is updated when something is new, and hides itself when it has nothing to show.

import {type Child, h} from '../../dom';
import type {SolveData} from '../../solve/data';

export interface Panel {
  readonly element: HTMLElement;
  update(data: SolveData): void;
  destroy?(): void;
}

export function section(title: string, ...children: Child[]): HTMLElement {
  return h('section', {class: 'card'}, h('h2', {}, title), ...children);
}

/** A list of terms and their values. Rows with an empty value are omitted. */
export function facts(rows: [string, Child][]): HTMLElement {
  return h(
    'dl',
    {class: 'facts'},
    rows
      .filter(([, value]) => value !== '' && value !== null && value !== undefined)
      .map(([term, value]) => h('div', {}, h('dt', {}, term), h('dd', {}, value))),
  );
}
