// SPDX-License-Identifier: Apache-2.0
// A view fills the main part of the page until another one does.

export interface View {
  readonly title: string;
  readonly element: HTMLElement;
  /** Stops everything that the view started. */
  destroy(): void;
}

/** Calls `act` at once and then every `interval` ms while the page is visible; the next call waits for the last. */
export function pollWhileVisible(interval: number, signal: AbortSignal, act: () => Promise<void>): void {
  const loop = async () => {
    while (!signal.aborted) {
      if (!document.hidden) await act();
      await new Promise((resolve) => setTimeout(resolve, interval));
    }
  };
  void loop();
}
