// SPDX-License-Identifier: Apache-2.0
// A text area with line numbers, in which lines can be marked as wrong.

import {h, replace, setText} from '../dom';

const lineHeight = 20;
const padding = 8;

export class Editor {
  readonly element: HTMLElement;
  readonly area: HTMLTextAreaElement;
  private readonly numbers = h('div', {class: 'numbers'});
  private readonly marks = h('div', {class: 'marks', 'aria-hidden': 'true'});
  private lines = 0;

  constructor(id: string, onInput: () => void) {
    this.area = h('textarea', {
      id,
      wrap: 'off',
      spellcheck: 'false',
      autocomplete: 'off',
      autocapitalize: 'off',
      rows: 20,
    });
    const gutter = h('div', {class: 'gutter', 'aria-hidden': 'true'}, this.numbers);
    this.element = h('div', {class: 'editor'}, gutter, this.marks, this.area);
    this.area.addEventListener('input', () => {
      this.count();
      onInput();
    });
    this.area.addEventListener('scroll', () => this.onScroll());
    this.count();
  }

  get text(): string {
    return this.area.value;
  }

  set text(text: string) {
    this.area.value = text;
    this.area.scrollTop = 0;
    this.count();
  }

  /** Marks lines, counted from 1. */
  mark(lines: number[]): void {
    replace(
      this.marks,
      [...new Set(lines)].map((line) => {
        const mark = h('div', {class: 'mark'});
        mark.style.top = `${padding + (line - 1) * lineHeight}px`;
        return mark;
      }),
    );
    this.area.setAttribute('aria-invalid', String(lines.length > 0));
    this.onScroll();
  }

  /** Puts the caret at `offset` and scrolls there. */
  goTo(offset: number, line: number): void {
    this.area.focus();
    this.area.setSelectionRange(offset, offset);
    this.area.scrollTop = Math.max(0, (line - 6) * lineHeight);
  }

  private count(): void {
    const lines = this.area.value.split('\n').length;
    if (lines === this.lines) return;
    this.lines = lines;
    setText(this.numbers, Array.from({length: lines}, (_, i) => i + 1).join('\n'));
  }

  private onScroll(): void {
    const shift = `translateY(${-this.area.scrollTop}px)`;
    this.numbers.style.transform = shift;
    this.marks.style.transform = shift;
  }
}
