// SPDX-License-Identifier: Apache-2.0
// The title of a solve, its progress, and its actions.

import {h, setText, show} from '../../dom';
import {errorText} from '../../rpc/errors';
import {writers} from '../../solve/download';

export interface Progress {
  title: string;
  state: string;
  /** The state whose look it has. */
  look: string;
  /** 0 to 1. */
  part: number;
  text: string;
  ended: boolean;
  canCancel: boolean;
  canDownload: boolean;
}

export interface Actions {
  stop: (() => Promise<void>) | null;
  remove: (() => Promise<void>) | null;
  /** Makes the file with this extension. */
  download: (extension: string) => Promise<void>;
}

export class Head {
  readonly element: HTMLElement;
  private readonly title = h('h1');
  private readonly state = h('span', {class: 'state'});
  private readonly bar = h('progress', {max: 1, 'aria-label': 'Progress'});
  private readonly text = h('p', {class: 'now'});
  private readonly trouble = h('p', {class: 'error', role: 'alert', hidden: true});
  private readonly cancel: HTMLButtonElement;
  private readonly remove: HTMLButtonElement;
  private readonly files: HTMLElement;

  constructor(private readonly actions: Actions) {
    this.cancel = this.button('Cancel', actions.stop);
    this.remove = this.button('Delete', actions.remove, 'Delete for good?');
    this.files = h(
      'span',
      {class: 'files'},
      'Download ',
      Object.keys(writers).map((extension) => this.button(extension.toUpperCase(), () => actions.download(extension))),
    );
    this.element = h(
      'header',
      {class: 'head'},
      h('div', {class: 'line'}, this.title, this.state),
      h('div', {class: 'line'}, this.bar, this.text),
      this.trouble,
      h('div', {class: 'buttons'}, this.cancel, this.remove, this.files),
    );
  }

  update({title, state, look, part, text, ended, canCancel, canDownload}: Progress): void {
    setText(this.title, title);
    setText(this.state, state);
    this.state.dataset.state = look;
    this.bar.value = part;
    show(this.bar, !ended);
    setText(this.text, text);
    show(this.cancel, canCancel && this.actions.stop !== null);
    show(this.remove, ended && this.actions.remove !== null);
    show(this.files, ended && canDownload);
  }

  showTrouble(trouble: string | null): void {
    setText(this.trouble, trouble ?? '');
    show(this.trouble, trouble !== null);
  }

  // With `question` the button asks before it acts.
  private button(text: string, act: (() => Promise<void>) | null, question?: string): HTMLButtonElement {
    const button = h('button', {type: 'button'}, text);
    button.addEventListener('click', async () => {
      if (question !== undefined && button.textContent !== question) {
        setText(button, question);
        button.addEventListener('blur', () => setText(button, text), {once: true});
        return;
      }
      button.disabled = true;
      try {
        await act?.();
      } catch (error) {
        this.showTrouble(errorText(error));
      } finally {
        button.disabled = false;
      }
    });
    return button;
  }
}
