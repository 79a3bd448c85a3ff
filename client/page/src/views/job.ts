// SPDX-License-Identifier: Apache-2.0
// The page of one job: #/jobs/NAME.

import {Code, ConnectError} from '@connectrpc/connect';
import type {SolveJob} from '../../generated/dlcs/v1/jobs_pb';
import {JobState} from '../../generated/dlcs/v1/solver_pb';
import {h} from '../dom';
import {ago, bytes, duration, general, milliseconds, timeLeft} from '../format';
import {canCancel, hasEnded, membersText, statusOf, titleOf} from '../names';
import {jobs, shortCall} from '../rpc/clients';
import {errorText} from '../rpc/errors';
import type {SolveData} from '../solve/data';
import {save, writers} from '../solve/download';
import {forgetModel, gridOf, restoreModel, saveModel} from '../solve/memory';
import {all, GrowingTrajectory, mostComponents, readWhole, strideFor} from '../solve/reading';
import {startedJobs} from '../solve/start';
import type {Trajectory} from '../solve/trajectory';
import {JobWatch} from '../solve/watch';
import {pollWhileVisible, type View} from './page';
import {Head} from './solve/head';
import {Panels} from './solve/panels';

const pollEvery = 1_000;
const readEvery = 700;
// The number of pairs in the iterates until others are chosen. The server holds fewer events if they are larger.
const firstPairs = 4;
// The call that started a job is read for this long, so that a short solve sends all its events. Its iterates are
// without y; those of a watch have it.
const startLasts = 500;
const drawEvery = 100;

export class JobView implements View {
  readonly title = 'Solve';
  readonly element: HTMLElement;
  private readonly ended = new AbortController();
  private readonly model;
  private readonly head: Head;
  private readonly panels: Panels;
  private watch: JobWatch | null = null;
  private readonly grid: number[];
  private readonly timer: ReturnType<typeof setInterval>;
  private job: SolveJob | null = null;
  private reader: GrowingTrajectory | null = null;
  /** Streams may be opened. */
  private ready = false;
  private chosen = '';

  constructor(private readonly name: string) {
    this.model = restoreModel(name);
    this.grid = gridOf(name);
    this.head = new Head({
      stop: async () => this.onJob(await jobs.cancelSolveJob({name}, shortCall())),
      remove: () => this.remove(),
      download: (extension) => this.download(extension),
    });
    this.panels = new Panels(
      () => this.data,
      () => this.onChoice(),
      () => this.loadField(),
    );
    this.element = h(
      'div',
      {},
      h('p', {}, h('a', {href: '#/jobs'}, 'All solves')),
      this.head.element,
      this.panels.element,
    );
    this.head.update({
      title: 'Loading …',
      state: '',
      look: '',
      part: 0,
      text: '',
      ended: false,
      canCancel: true,
      canDownload: false,
    });
    this.timer = setInterval(() => this.readMore(), readEvery);
    void this.takeOver();
    // The browser may discard a hidden page without another event.
    document.addEventListener('visibilitychange', this.save, {signal: this.ended.signal});
    addEventListener('pagehide', this.save, {signal: this.ended.signal});
    pollWhileVisible(pollEvery, this.ended.signal, () => this.poll());
  }

  destroy(): void {
    this.save();
    this.ended.abort();
    this.watch?.stop();
    clearInterval(this.timer);
    this.panels.destroy();
  }

  private async takeOver(): Promise<void> {
    const started = startedJobs.get(this.name);
    if (started !== undefined) {
      const drawing = setInterval(() => this.panels.refresh(), drawEvery);
      await Promise.race([started.left, new Promise((resolve) => setTimeout(resolve, startLasts))]);
      clearInterval(drawing);
    }
    this.ready = true;
    if (this.job !== null && !this.ended.signal.aborted) this.onJob(this.job);
  }

  private readonly save = () => {
    if (this.model.version > 0) saveModel(this.name, this.model);
  };

  private get data(): SolveData {
    const {job, model} = this;
    return {
      title: this.jobTitle,
      states: job?.states || model.analysis?.states || 0,
      pairs: job?.constraints || model.analysis?.constraints || 0,
      outputs: model.analysis?.outputNames.length ?? 0,
      horizon: job?.horizon ?? 0,
      grid: this.grid,
      model,
      trajectory: this.reader?.trajectory ?? null,
    };
  }

  private get jobTitle(): string {
    return this.job === null ? 'Untitled solve' : titleOf(this.job);
  }

  private startWatch(): JobWatch {
    const pairs = () => {
      const {chosen} = this.panels;
      return chosen.pairs.length > 0 ? chosen.pairs : all(Math.min(firstPairs, this.data.pairs));
    };
    return new JobWatch(this.name, pairs, {
      lastSequence: () => this.model.lastSequence,
      onEvent: (event) => {
        this.model.onEvent(event);
        if (event.kind.case === 'analysis') this.onAnalysis();
        if (event.kind.case === 'summary') void this.poll();
        this.panels.refresh();
      },
      onTrouble: (text) => this.head.showTrouble(text),
      onNoEvents: () => void this.poll(),
    });
  }

  private async poll(): Promise<void> {
    if (this.job !== null && hasEnded(this.job.state) && this.model.ended && this.ready) return;
    try {
      this.onJob(await jobs.getSolveJob({name: this.name}, {...shortCall(), signal: this.ended.signal}));
      this.head.showTrouble(null);
    } catch (error) {
      if (this.ended.signal.aborted) return;
      // A name that cannot be one is an invalid argument.
      if ([Code.NotFound, Code.InvalidArgument].includes(ConnectError.from(error).code)) {
        this.watch?.stop();
        forgetModel(this.name);
        this.head.showTrouble(null);
        this.head.element.replaceChildren(
          h('h1', {}, 'There is no such solve'),
          h('p', {}, 'It was deleted or expired.'),
        );
        this.panels.element.hidden = true;
        this.ended.abort();
      } else {
        this.head.showTrouble(errorText(error));
      }
    }
  }

  private onJob(job: SolveJob): void {
    this.job = job;
    document.title = `${this.jobTitle} – dlcs`;
    if (job.ensemble !== undefined) this.showEnsemble(job);
    else if (!this.model.ended && this.ready) this.watch ??= this.startWatch();
    if (hasEnded(job.state)) {
      // Shows the error only if nothing was solved; otherwise the summary describes the end.
      const {error, summary} = job;
      if (error !== undefined && summary === undefined) this.head.showTrouble(`It failed: ${error.message}`);
      if (this.ready && (job.summary !== undefined || this.watch === null)) this.model.finish(job.summary);
    }
    this.updateHead(job);
    this.readMore();
    this.panels.refresh();
  }

  // For an ensemble the job itself holds everything that is shown here; it has no trajectory.
  private showEnsemble(job: SolveJob): void {
    if (this.panels.element.hidden) return;
    this.panels.element.hidden = true;
    this.element.append(
      h('p', {class: 'card'}, 'The results of its members: ', h('code', {}, `dlcs result ${job.name}`)),
    );
  }

  private updateHead(job: SolveJob): void {
    const ended = hasEnded(job.state);
    const from = job.startTime ?? job.createTime;
    const to = job.endTime === undefined ? Date.now() : milliseconds(job.endTime);
    const elapsed = from === undefined ? 0 : Math.max(0, (to - milliseconds(from)) / 1000);
    const part = Math.max(job.progress, job.horizon > 0 ? this.model.reached / job.horizon : 0);
    const texts = ended
      ? [
          `Took ${duration(elapsed)}`,
          job.ensemble === undefined ? '' : membersText(job.ensemble),
          `created ${ago(job.createTime)}`,
          `${bytes(job.storedBytes)} stored`,
        ]
      : job.state === JobState.QUEUED
        ? ["Waiting in the server's queue"]
        : [
            job.ensemble === undefined
              ? `t = ${general(this.model.reached, 4)} of ${general(job.horizon, 4)}`
              : membersText(job.ensemble),
            duration(Math.floor(elapsed)),
            timeLeft(elapsed, part),
          ];
    const {text, look} = statusOf(job);
    this.head.update({
      title: this.jobTitle,
      state: text,
      look,
      part: ended ? 1 : Math.min(part, 1),
      text: texts.filter((text) => text !== '').join(', '),
      ended,
      canCancel: canCancel(job.state),
      canDownload: (this.model.summary?.times ?? 0) > 0,
    });
  }

  // Reads what is stored by now. The first reader begins when there is something to read.
  private readMore(): void {
    const {states, pairs, model} = this.data;
    const times = model.summary?.times ?? model.storedTimes;
    if (times === 0 || states + pairs === 0 || !this.ready || this.job?.ensemble !== undefined) return;
    if (this.reader === null) this.reader = this.startReading(times);
    if (model.ended || this.reader.trajectory.times.length * this.reader.selection.stride < times) {
      void this.reader.update(model.ended);
    }
  }

  private startReading(times: number): GrowingTrajectory {
    const {states, pairs, outputs, model} = this.data;
    const few = states + 2 * pairs + outputs <= mostComponents;
    const {chosen} = this.panels;
    const some = (list: number[], total: number) => (list.length > 0 || total === 0 ? list : all(Math.min(total, 4)));
    const xs = few ? all(states) : some(chosen.states, states);
    const ys = few ? all(pairs) : some(chosen.pairs, pairs);
    const zs = few ? all(outputs) : some(chosen.outputs, outputs);
    const steps = Math.max(times, model.analysis?.steps ?? 0);
    return new GrowingTrajectory(
      this.name,
      {xs, ys, zs, stride: strideFor(steps, xs.length, ys.length, zs.length)},
      {states, pairs, outputs},
      this.ended.signal,
      (error) => {
        if (error !== undefined) this.head.showTrouble(errorText(error));
        this.panels.refresh();
      },
    );
  }

  // The trajectory of a job that has ended may have been read before it was known that there are outputs.
  private onAnalysis(): void {
    if (this.reader === null || this.data.outputs === 0 || this.reader.selection.zs.length > 0) return;
    this.reader = null;
    this.readMore();
  }

  // Reads again if components were chosen that are not held.
  private onChoice(): void {
    const {states, pairs, outputs} = this.panels.chosen;
    const held = this.reader?.selection;
    const has = (all: number[], wanted: number[]) => wanted.every((i) => all.includes(i));
    if (held && !(has(held.xs, states) && has(held.ys, pairs) && has(held.zs, outputs))) {
      this.reader = null;
      this.readMore();
    }
    if (!this.model.ended && pairs.join() !== this.chosen) this.watch?.restart();
    this.chosen = pairs.join();
    this.panels.refresh();
  }

  private async loadField(): Promise<Trajectory> {
    const {states, pairs, outputs, model} = this.data;
    const times = model.summary?.times ?? model.storedTimes;
    const field = new GrowingTrajectory(
      this.name,
      {xs: all(states), ys: all(pairs), zs: [], stride: strideFor(times, states, pairs, 0)},
      {states, pairs, outputs},
      this.ended.signal,
      (error) => {
        if (error !== undefined) this.head.showTrouble(errorText(error));
      },
    );
    await field.update(true);
    return field.trajectory;
  }

  private async download(extension: string): Promise<void> {
    const {title, states, pairs, model} = this.data;
    const writer = writers[extension]({
      title,
      job: this.name,
      names: model.names,
      analysis: model.analysis,
      summary: model.summary,
      states,
      pairs,
    });
    await readWhole(this.name, this.ended.signal, (page) => page.chunk && writer.add(page.chunk));
    save(writer.finish(), `${title.replace(/[^\w.-]+/g, '-')}.${extension}`);
  }

  private async remove(): Promise<void> {
    await jobs.deleteSolveJob({name: this.name}, shortCall());
    startedJobs.delete(this.name);
    this.ended.abort();
    forgetModel(this.name);
    location.hash = '#/jobs';
  }
}
