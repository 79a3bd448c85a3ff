// SPDX-License-Identifier: Apache-2.0
// Makes and changes elements. Text is always set as text, never as HTML.

export type Child = Node | string | number | null | undefined | false | Child[];
type Handlers = {[Name in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[Name]) => void};
export type Properties = {
  class?: string;
  on?: Handlers;
  [attribute: string]: string | number | boolean | Handlers | undefined;
};

export function h<Tag extends keyof HTMLElementTagNameMap>(
  tag: Tag,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[Tag] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name === 'on') {
      for (const [event, handler] of Object.entries(value as Handlers)) {
        element.addEventListener(event, handler as EventListener);
      }
    } else if (value !== undefined && value !== false) {
      element.setAttribute(name, value === true ? '' : String(value));
    }
  }
  append(element, children);
  return element;
}

function append(element: Node, children: Child[]): void {
  for (const child of children) {
    if (Array.isArray(child)) {
      append(element, child);
    } else if (child !== null && child !== undefined && child !== false) {
      element.appendChild(child instanceof Node ? child : document.createTextNode(String(child)));
    }
  }
}

export function replace(element: Element, ...children: Child[]): void {
  element.replaceChildren();
  append(element, children);
}

/** Sets the text only where it differs, so that a selection in it survives. */
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

export function show(element: HTMLElement, visible: boolean): void {
  element.hidden = !visible;
}

/** A table with a head, for rows of texts or elements. */
export function table(head: string[], rows: Child[][], properties: Properties = {}): HTMLElement {
  return h(
    'div',
    {class: 'scroll', tabindex: 0, role: 'region', 'aria-label': String(properties.label ?? 'Table')},
    h(
      'table',
      {class: String(properties.class ?? '')},
      h(
        'thead',
        {},
        h(
          'tr',
          {},
          head.map((title) => h('th', {scope: 'col'}, title)),
        ),
      ),
      h(
        'tbody',
        {},
        rows.map((row) =>
          h(
            'tr',
            {},
            row.map((cell) => h('td', {}, cell)),
          ),
        ),
      ),
    ),
  );
}

/** Calls `draw` in the next frame, once, however often it is asked for before. */
export function oncePerFrame(draw: () => void): () => void {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      draw();
    });
  };
}
