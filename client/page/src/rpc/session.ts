// SPDX-License-Identifier: Apache-2.0
// The token of a server with users: asked for once, kept until the tab is closed, sent in a header and never in an
// address.

import {h, setText, show} from '../dom';

const key = 'dlcs-token';

let asking: Promise<void> | null = null;

export function token(): string {
  return sessionStorage.getItem(key) ?? '';
}

export function forgetToken(): void {
  sessionStorage.removeItem(key);
}

/** Asks for a token; calls that are refused meanwhile wait for the same answer. */
export function askForToken(reason: string): Promise<void> {
  asking ??= ask(reason).finally(() => {
    asking = null;
  });
  return asking;
}

function ask(reason: string): Promise<void> {
  return new Promise((resolve) => {
    const input = h('input', {type: 'password', id: 'token', autocomplete: 'off', required: true, spellcheck: 'false'});
    const notice = h('p', {class: 'error', role: 'alert'});
    setText(notice, reason);
    show(notice, token() !== '');
    const dialog = h(
      'dialog',
      {class: 'login', 'aria-labelledby': 'login-title'},
      h(
        'form',
        {method: 'dialog'},
        h('h2', {id: 'login-title'}, 'Log in'),
        h(
          'p',
          {},
          'This server has users. Enter the token that its operator gave you. ' +
            'It is kept until you close this tab.',
        ),
        notice,
        h('label', {for: 'token'}, 'Token'),
        input,
        h('div', {class: 'buttons'}, h('button', {class: 'main', type: 'submit'}, 'Log in')),
      ),
    );
    // Without a token nothing works, so Escape does not close it.
    dialog.addEventListener('cancel', (event) => event.preventDefault());
    dialog.addEventListener('close', () => {
      sessionStorage.setItem(key, input.value.trim());
      dialog.remove();
      resolve();
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}
