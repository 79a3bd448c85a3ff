// SPDX-License-Identifier: Apache-2.0
// The page of a solve on a server without jobs: #/solve.

import {Termination} from '../../generated/dlcs/v1/solver_pb';
import {h, replace} from '../dom';
import {duration, general, timeLeft} from '../format';
import {uselessText} from '../names';
import {save, writers} from '../solve/download';
import {type StreamedSolve, streamed} from '../solve/stream';
import type {View} from './page';
import {Head} from './solve/head';
import {Panels} from './solve/panels';

export class StreamView implements View {
  readonly title = 'Solve';
  readonly element = h('div');
  private readonly panels: Panels | null = null;
  private readonly timer: ReturnType<typeof setInterval> | undefined;

  constructor() {
    const {solve} = streamed;
    if (solve === null) {
      replace(
        this.element,
        h(
          'p',
          {class: 'card'},
          'There is no solve in this tab. A server without --store keeps none, and a tab forgets its own when it is ',
          'loaded again. ',
          h('a', {href: '#/submit'}, 'Submit a problem.'),
        ),
      );
      return;
    }
    const head = new Head({stop: () => solve.stop(), remove: null, download: async (type) => download(solve, type)});
    const panels = new Panels(
      () => solve.data,
      () => panels.refresh(),
      null,
    );
    this.panels = panels;
    replace(this.element, head.element, panels.element);
    const update = () => {
      updateHead(head, solve);
      panels.refresh();
    };
    solve.onChange = update;
    this.timer = setInterval(update, 500);
    update();
  }

  destroy(): void {
    clearInterval(this.timer);
    if (streamed.solve !== null) streamed.solve.onChange = () => undefined;
    this.panels?.destroy();
  }
}

/** As the status of a job. */
function statusOf({running, waiting, trouble, model: {summary}}: StreamedSolve): {text: string; look: string} {
  const plain = (look: string) => ({text: look, look});
  if (running) return plain(waiting ? 'waiting' : 'running');
  if (summary?.termination === Termination.CANCELLED) return plain('cancelled');
  if (summary !== null && !summary.verdict?.success) return {text: uselessText(summary), look: 'failed'};
  return plain(trouble === null ? 'ended' : 'failed');
}

function updateHead(head: Head, solve: StreamedSolve): void {
  const {model, horizon} = solve.data;
  const elapsed = ((solve.running ? Date.now() : solve.endedAt) - solve.startedAt) / 1000;
  const part = horizon > 0 ? Math.min(1, model.reached / horizon) : 0;
  const running = [
    `t = ${general(model.reached, 4)} of ${general(horizon, 4)}`,
    duration(Math.floor(elapsed)),
    timeLeft(elapsed, part),
  ]
    .filter((text) => text !== '')
    .join(', ');
  const waiting = 'Another tab of this page receives a solve; this one begins when that one has ended.';
  const status = statusOf(solve);
  head.update({
    title: solve.title || 'Untitled solve',
    state: status.text,
    look: status.look,
    part,
    text: solve.running ? (solve.waiting ? waiting : running) : `Took ${duration(elapsed)}`,
    ended: !solve.running,
    canCancel: solve.running,
    canDownload: solve.chunks.length > 0,
  });
  head.showTrouble(solve.trouble);
}

function download(solve: StreamedSolve, extension: string): void {
  const {states, pairs, model, title} = solve.data;
  const writer = writers[extension]({
    title,
    job: '',
    names: model.names,
    analysis: model.analysis,
    summary: model.summary,
    states,
    pairs,
  });
  solve.chunks.forEach((chunk) => writer.add(chunk));
  save(writer.finish(), `${(title || 'solve').replace(/[^\w.-]+/g, '-')}.${extension}`);
}
