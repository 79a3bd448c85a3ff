// SPDX-License-Identifier: Apache-2.0
// Chooses components: by a box for each where they are few, otherwise by numbers such as 1-4, 9.

import {h, replace} from '../../dom';

const mostBoxes = 12;
export const mostChosen = 16;

let made = 0;

export class Picker {
  readonly element: HTMLElement;
  chosen: number[] = [];
  private total = -1;
  private names = '';
  private readonly id = `picker-${++made}`;

  constructor(
    private readonly title: string,
    private readonly onChange: () => void,
  ) {
    this.element = h('div', {class: 'picker', role: 'group', 'aria-label': title});
  }

  set(total: number, name: (i: number) => string): void {
    const names = Array.from({length: Math.min(total, mostBoxes)}, (_, i) => name(i)).join();
    if (total === this.total && names === this.names) return;
    if (total !== this.total) this.chosen = Array.from({length: Math.min(total, 4)}, (_, i) => i);
    this.total = total;
    this.names = names;
    replace(this.element, total <= mostBoxes ? this.boxes(name) : this.field());
  }

  private boxes(name: (i: number) => string): HTMLElement[] {
    return Array.from({length: this.total}, (_, i) => {
      const box = h('input', {type: 'checkbox', id: `${this.id}-${i}`, checked: this.chosen.includes(i)});
      box.addEventListener('change', () => {
        this.chosen = box.checked ? [...this.chosen, i].sort((a, b) => a - b) : this.chosen.filter((c) => c !== i);
        this.onChange();
      });
      return h('label', {class: 'check', for: `${this.id}-${i}`}, box, name(i));
    });
  }

  private field(): HTMLElement[] {
    const input = h('input', {id: this.id, value: '1-4', spellcheck: 'false', autocomplete: 'off'});
    const notice = h('span', {class: 'error', role: 'alert'});
    input.addEventListener('change', () => {
      const chosen = parseRanges(input.value, this.total);
      notice.textContent = chosen === null ? `must be numbers from 1 to ${this.total}, such as 1-4, 9` : '';
      if (chosen === null) return;
      if (chosen.length > mostChosen) notice.textContent = `the first ${mostChosen} are shown`;
      this.chosen = chosen.slice(0, mostChosen);
      this.onChange();
    });
    return [h('label', {for: this.id}, `${this.title}, of ${this.total}`), input, notice];
  }
}

function parseRanges(text: string, total: number): number[] | null {
  const chosen = new Set<number>();
  for (const part of text.split(/[\s,]+/).filter((p) => p !== '')) {
    const match = /^(\d+)(?:-(\d+))?$/.exec(part);
    if (match === null) return null;
    const from = Number(match[1]);
    const to = Number(match[2] ?? match[1]);
    if (from < 1 || to > total || to < from) return null;
    for (let i = from; i <= to && chosen.size <= mostChosen; ++i) chosen.add(i - 1);
  }
  return [...chosen];
}
